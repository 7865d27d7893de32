# SPDX-License-Identifier: Apache-2.0
"""From the placed design to the bitstream: what its file gets after the placement, and the packer.

The firmware takes the place of the placeholder (block_ram.py). The analog part of a PLL gets its
settings, which nextpnr leaves at 0. Neither changes anything of a placement, so new firmware and
other settings need no new one.
"""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from boards.block_ram import ContentsError
from boards.fit import Design
from boards.generate import placeholder
from boards.size import firmware_stem
from boards.toml_file import ROOT
from figures.synthesis import SynthesisError, run

PLACED, FILLED = "placed", "filled"  # files: as nextpnr wrote it, and what is packed instead


def program_of(design: Design, folder: Path) -> Path:
    """The file of the firmware that a bitstream is made with: its bytes for the flash of a serial
    core, else words for the block RAMs.
    """
    end = "bin" if design.machine.core == "serial" else "hex"
    return folder / f"{firmware_stem(design.machine)}.{end}"


def code_of(design: Design, folder: Path) -> Path | None:
    """The file of what a soft core executes from the flash; None if it does not."""
    if design.machine.core != "flash":
        return None
    return folder / f"{firmware_stem(design.machine)}.flash"


def with_firmware(design: Design, folder: Path, text: str) -> str:
    """The file of a placed design with the firmware in its block RAMs, if it has it there."""
    contents = design.placer.contents
    if not design.in_block_ram or contents is None:
        return text
    words = [int(word, 16) for word in program_of(design, folder).read_text().split()]
    try:
        return contents.filled(text, placeholder(design), words)
    except ContentsError as why:
        raise SynthesisError(f"the firmware of {design.name} cannot be replaced: {why}") from None


def settings_of(design: Design) -> Mapping[str, int]:
    """What the analog part of the PLL is set to, if there is one."""
    return design.pll.analog if design.pll else {}


def with_settings(text: str, settings: Mapping[str, int]) -> str:
    """The file of a placed ECP5 with these settings of its PLL in place of zeros."""
    for name, value in settings.items():
        found = re.findall(rf"^word: {name} 0+$", text, re.MULTILINE)
        if len(found) != 1:
            raise SynthesisError(f"the placed design has {len(found)} settings {name}, not 1")
        head, _, zeros = found[0].rpartition(" ")
        text = text.replace(f"{found[0]}\n", f"{head} {value:0{len(zeros)}b}\n")
    return text


def fill(design: Design, folder: Path) -> str:
    """Writes the file that is packed, with what nextpnr did not put into it; returns its name."""
    analog = settings_of(design)
    if not design.in_block_ram and not analog:
        return PLACED
    text = with_firmware(design, folder, (folder / PLACED).read_text())
    (folder / FILLED).write_text(with_settings(text, analog))
    return FILLED


def pack(design: Design, folder: Path) -> Path:
    """The bitstream; for a serial core the image of the flash, with the firmware behind it."""
    part, here = design.board.part, folder.relative_to(ROOT)
    made = folder / part.family.bitstream
    words = design.placer.pack(part, here / fill(design, folder), made.relative_to(ROOT))
    run(words, "packing", folder / "pack.log")
    if design.machine.core == "serial":
        program = program_of(design, folder).read_bytes()
        content, start = made.read_bytes(), design.firmware_address
        if len(content) > start:
            raise SynthesisError(
                f"the bitstream has {len(content)} bytes, the firmware is at {start}"
            )
        made.write_bytes(content.ljust(start, b"\xff") + program)
    return made


def packing_hash(design: Design, folder: Path) -> str:
    """A hash of what a bitstream is made of beside the placement: the options of the packer, the
    settings of the PLL, and the firmware, which a relay does not have.
    """
    program = program_of(design, folder).read_bytes() if design.machine.image else b""
    options = design.placer.pack(design.board.part, Path(PLACED), Path())
    known = repr((options, settings_of(design)))
    return hashlib.sha256(known.encode() + program).hexdigest()

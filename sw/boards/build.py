# SPDX-License-Identifier: Apache-2.0
"""Make everything of a machine on a board: `make board BOARD=x MACHINE=y`.

build/boards/x-y/ gets top.sv, the constraints (pins.lpf or pins.pcf), wiring.html, wiring.svg, the
firmware and moire.bit. The machine is one of constraints/machines, or a .toml file anywhere. What
does not fit is refused in one line before any tool runs; the exit code is 1 then.

A firmware in block RAM is put into the placed design (block_ram.py): with new firmware only,
nothing is placed again. `--firmware` (`make firmware`) does this alone, and refuses to place.

python -m boards.build --board x --machine y [--only-files | --firmware]
"""

import argparse
import hashlib
import inspect
import json
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from boards import board as boards
from boards import ethernet
from boards import machine as machines
from boards.board import Board
from boards.circuit import TOP, circuit_hash
from boards.fit import Design, fit
from boards.generate import files
from boards.machine import Machine
from boards.packing import PLACED, pack, packing_hash
from boards.toml_file import ROOT, Misfit, TooLarge, shown
from figures.synthesis import SynthesisError, placed, yosys
from firmware import build as firmware
from twin.netlist import elaboration

OUT = ROOT / "build" / "boards"
NOTE = "note"  # of what the bitstream in a folder was made of
# primitives of the Ethernet core besides those of the family
FLIP_FLOPS = {"ecp5": "+/ecp5/cells_sim.v", "xc7": "+/xilinx/cells_sim.v"}
KINDS = {  # of cells of a 7-series part, by the beginning of their names
    "LUT": "LUT",
    "FD": "flip-flops",
    "CARRY4": "carry chains of 4 bits",
    "RAMB36": "block RAMs of 36 kbit",
    "RAMB18": "of 18 kbit",
    "DSP48": "multipliers",
}


def wired() -> Iterator[tuple[Board, Machine]]:
    """Each machine of the project with each board that it is wired for."""
    known = [machines.named(name) for name in machines.names()]
    for board in map(boards.named, boards.names()):
        yield from ((board, machine) for machine in known if board.layout in machine.wiring)


def fitting() -> tuple[list[Design], list[str]]:
    """What is wired: the designs that fit, and why parts are too small for the others."""
    found, refused = [], []
    for board, machine in wired():
        try:
            found.append(fit(board, machine))
        except TooLarge as why:
            refused.append(str(why))
    return found, refused


def write(design: Design) -> Path:
    """Writes what is made before any tool runs; returns the folder."""
    folder = OUT / design.name
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files(design).items():
        (folder / name).write_text(text, encoding="utf-8")
    if design.ethernet:
        board, phy = design.board, design.ethernet
        delays = phy.tx_delay_ns, phy.rx_delay_ns
        made = ethernet.core(phy.interface, board.part.family.name, board.node_hz, delays)
        shutil.copyfile(made, folder / made.name)
    return folder


def make_firmware(design: Design, folder: Path) -> str:
    """Builds the firmware of the node, and reports its size; a relay has none."""
    machine = design.machine
    if not machine.image:
        return f"{machine.name} has no firmware"
    chosen = machine.image, len(machine.axes), machine.core, machine.update
    try:
        return firmware.build(1024 * machine.memory_kib, folder, False, *chosen)
    except firmware.BuildError as why:
        raise Misfit(f"{machine.file}: {why}") from None


def check_tools(design: Design) -> None:
    """Refuses a part whose tools are not there."""
    part, family = design.board.part, design.board.part.family
    if not family.has_tools():
        raise Misfit(
            f"{design.board.file}: the tools for a {part.name} are missing: "
            f"make {family.fetched} gets them"
        )


def synthesise(design: Design, folder: Path) -> Path:
    """The netlist of the top."""
    part, family = design.board.part, design.board.part.family
    written = family.netlist.replace("{folder}", str(folder.relative_to(ROOT)))
    last = f"{family.synthesis} {part.synthesis} -top {{top}} {written}"
    first = family.read_cells
    if design.ethernet:
        core = (folder / f"{ethernet.NAME}.v").relative_to(ROOT)
        first += f"; read_verilog -lib {FLIP_FLOPS[family.name]}; read_verilog {core}"
    netlist = yosys(folder / "top.sv", {}, last, f"board-{design.name}", first)
    family.finish(netlist)
    return netlist


def chip(design: Design) -> list[str]:
    """The options of nextpnr for the part."""
    return design.placer.chip(design.board.part)


def pinned(design: Design, folder: Path) -> list[str | Path]:
    """The options of nextpnr for the placement and the pins. The path is that from the root, since
    a YoWASP tool has a /tmp of its own.
    """
    part = design.board.part
    pins = folder.relative_to(ROOT) / part.family.constraints
    return [*part.place, *design.placer.pins(pins)]


def place(design: Design, folder: Path, netlist: Path, seed: int) -> tuple[float, dict[str, Any]]:
    """(MHz, utilization) after place and route; a clock that is not reached is a result. Whatever
    was placed in this folder is replaced, so its note and its bitstream go.
    """
    for name in (NOTE, design.board.part.family.bitstream):
        (folder / name).unlink(missing_ok=True)
    by, mhz = design.placer, design.board.node_hz / 1e6
    written = by.made(folder.relative_to(ROOT) / PLACED)
    return placed(netlist, by.nextpnr, chip(design), mhz, seed, *pinned(design, folder), *written)


def counted(design: Design, folder: Path, netlist: Path) -> dict[str, Any]:
    """The utilization of the part after packing, without a placement: {cell: {used, available}}."""
    by, mhz = design.placer, design.board.node_hz / 1e6
    more = (*pinned(design, folder), "--pack-only")
    return placed(netlist, by.nextpnr, chip(design), mhz, 1, *more)[1]


def used(design: Design, utilization: Mapping[str, Any]) -> str:
    """What a design takes of its part."""
    words = [
        f"{utilization[cell]['used']} of {utilization[cell]['available']} {name}"
        for name, cell in design.placer.used.items()
        if cell in utilization
    ]
    return ", ".join(words)


def cells(netlist: Path) -> str:
    """The largest kinds of cells of a netlist, for a part that is not placed."""
    found: Counter[str] = Counter()
    for cell in json.loads(netlist.read_text())["modules"][TOP]["cells"].values():
        kind = cell["type"]
        found[next((words for start, words in KINDS.items() if kind.startswith(start)), "")] += 1
    return ", ".join(f"{found[words]} {words}" for words in KINDS.values() if found[words])


def state(design: Design) -> str:
    """A hash of all that the placement depends on, except its seed."""
    here = Path(__file__)
    sources = sorted((ROOT / "rtl").rglob("*.sv")) + [ROOT / "requirements.lock", here]
    sources += [here.with_name(name) for name in ("family.py", "global_reset.py", "gowin.lock")]
    sources += [Path(inspect.getfile(each)) for each in (yosys, elaboration)]
    sources += ethernet.SOURCES if design.ethernet else ()
    found = hashlib.sha256((design.board.part.synthesis + told(design)).encode())
    for path in sources:
        found.update(path.name.encode() + path.read_bytes())
    for name, text in files(design).items():
        found.update(name.encode() + text.encode())
    return found.hexdigest()


def told(design: Design) -> str:
    """What nextpnr is told of a design beside its netlist and a seed, and its version."""
    locks = (ROOT / "requirements.lock", Path(__file__).with_name("gowin.lock"))
    versions = [
        line
        for lock in locks
        for line in lock.read_text().splitlines()
        if "nextpnr" in line or "apycula" in line.lower()
    ]
    family = design.board.part.family
    options = [*chip(design), *pinned(design, OUT)] if family.placer else []
    constraints = files(design)[family.constraints]
    return repr((versions, [*options, design.board.node_hz], constraints))


def netlist_state(design: Design, netlist: Path) -> str:
    """A hash of the circuit and of all else that nextpnr sees, except its seed. A change of the RTL
    that gives other names or another order to the same circuit leaves it as it was: a placement of
    that differs as one with another seed would.
    """
    return hashlib.sha256((told(design) + circuit_hash(netlist)).encode()).hexdigest()


@dataclass(frozen=True)
class Note:
    """What the bitstream in a folder was made of; an empty text is no bitstream or no placement."""

    placement: str = ""  # its state
    seed: str = ""
    packing: str = ""  # hash of what the bitstream was made of beside the placement

    @classmethod
    def read(cls, folder: Path) -> "Note":
        file = folder / NOTE
        lines = file.read_text().split() if file.is_file() and (folder / PLACED).is_file() else []
        return cls(*lines[:3])

    def write(self, folder: Path) -> None:
        (folder / NOTE).write_text(f"{self.placement} {self.seed} {self.packing}\n")


def note_of(design: Design) -> Note:
    """The note of the placement that is there, if it is one of this design."""
    folder = OUT / design.name
    note = Note.read(folder)
    if note.placement != state(design):
        raise Misfit(
            f"{shown(folder)} has no placement of this board, machine and RTL: make board "
            f"{design.arguments} makes it"
        )
    return note


def placed_again(design: Design, folder: Path, seed: int, say: Callable[[str], None]) -> None:
    """Synthesis and placement; a missed clock is refused."""
    node_mhz = design.board.node_hz / 1e6
    say(f"--- {design.name}: synthesis")
    netlist = synthesise(design, folder)
    say(f"--- {design.name}: place and route for {node_mhz:g} MHz")
    mhz, utilization = place(design, folder, netlist, seed)
    say(f"{used(design, utilization)}, {mhz:.1f} MHz")
    if mhz < node_mhz:
        raise SynthesisError(
            f"{design.name} reaches {mhz:.1f} MHz with seed {seed} and needs {node_mhz:g}: try "
            "another SEED"
        )


def packed(design: Design, folder: Path, placement: Note, say: Callable[[str], None]) -> Path:
    """The bitstream of a placement with the firmware that is there; it is made again only if the
    firmware or an option of the packer is another one.
    """
    made, now = folder / design.board.part.family.bitstream, packing_hash(design, folder)
    if placement.packing != now or not made.is_file():
        say(f"--- {design.name}: bitstream")
        pack(design, folder)
        replace(placement, packing=now).write(folder)
    return made


def bitstream(design: Design, seed: int, say: Callable[[str], None]) -> Path:
    """The bitstream of a machine on a board; nothing is built if nothing has changed."""
    check_tools(design)
    folder = write(design)
    say(f"--- {design.name}: wiring: {shown(folder / 'wiring.html')}")
    say(make_firmware(design, folder))
    if design.board.part.family.placer is None:
        say(f"--- {design.name}: synthesis")
        say(cells(synthesise(design, folder)))
        return folder / design.board.part.family.script
    note, now = Note.read(folder), Note(state(design), str(seed))
    if (note.placement, note.seed) != (now.placement, now.seed):
        placed_again(design, folder, seed, say)
        now.write(folder)
        note = now
    return packed(design, folder, note, say)


def new_firmware(design: Design, say: Callable[[str], None]) -> Path:
    """The bitstream of a placement that is there with new firmware; nothing is placed."""
    folder = OUT / design.name
    if not design.machine.image:
        raise Misfit(f"{design.machine.file}: a relay has no firmware")
    if design.board.part.family.placer is None:
        raise Misfit(
            f"{design.board.file}: the firmware is part of the netlist of a "
            f"{design.board.part.name}: make board {design.arguments} makes both"
        )
    check_tools(design)
    note = note_of(design)
    say(make_firmware(design, folder))
    return packed(design, folder, note, say)


def chosen(board_name: str, machine_name: str) -> tuple[Board, Machine]:
    """The board and the machine that are named; if one is missing, all that there are."""
    if not board_name or not machine_name:
        rows = [f"  make board BOARD={d.board.name} MACHINE={d.machine.name}" for d in fitting()[0]]
        raise Misfit("say which board and which machine:\n" + "\n".join(rows))
    return boards.named(board_name), machines.named(machine_name)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--board", default="", help="a folder of constraints/")
    parser.add_argument("--machine", default="", help="a name of constraints/machines, or a file")
    parser.add_argument("--seed", type=int, default=1, help="of the placement")
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--only-files", action="store_true", help="run no tool")
    only.add_argument(
        "--firmware", action="store_true", help="new firmware into the placement that is there"
    )
    options = parser.parse_args()
    say = lambda words: print(words, flush=True)
    try:
        design = fit(*chosen(options.board, options.machine))
        if options.only_files:
            print(shown(write(design)))
            return
        if options.firmware:
            made = new_firmware(design, say)
        else:
            made = bitstream(design, options.seed, say)
    except (Misfit, SynthesisError) as why:
        sys.exit(f"board: {why}")
    family = design.board.part.family
    if family.placer is None:
        print(
            f"no open tool places a {design.board.part.name}: vivado -mode batch -source "
            f"{shown(made)} makes {shown(made.with_name(family.bitstream))}"
        )
    else:
        print(shown(made))
    print(f"load it: make {design.board.loader.target} {design.arguments}")


if __name__ == "__main__":
    main()

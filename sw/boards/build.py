# SPDX-License-Identifier: Apache-2.0
"""Make everything of a machine on a board: `make board BOARD=x MACHINE=y`.

build/boards/x-y/ gets top.sv, the constraints (pins.lpf or pins.pcf), wiring.html, wiring.svg, the
firmware and moire.bit. The machine is one of constraints/machines, or a .toml file anywhere. What
does not fit is refused in one line before any tool runs; the exit code is 1 then.

python -m boards.build --board x --machine y [--only-files]
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from boards import board as boards
from boards import machine as machines
from boards.board import Board
from boards.fit import Design, fit
from boards.generate import BITSTREAM, CONSTRAINTS, files
from boards.machine import Machine
from boards.size import firmware_stem
from boards.toml_file import ROOT, Misfit, shown
from figures.synthesis import SynthesisError, cores, overfull, run
from firmware import build as firmware

OUT = ROOT / "build" / "boards"
TOOLS = Path(sys.executable).parent


def fitting() -> list[Design]:
    """Each machine of the project on each board that it is wired for."""
    chosen = [machines.named(name) for name in machines.names()]
    return [
        fit(board, machine)
        for board in map(boards.named, boards.names())
        for machine in chosen
        if board.layout in machine.wiring
    ]


def write(design: Design) -> Path:
    """Writes what is made before any tool runs; returns the folder."""
    folder = OUT / design.name
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files(design).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def make_firmware(design: Design, folder: Path) -> None:
    machine = design.machine
    try:
        report = firmware.build(
            1024 * machine.memory_kib, folder, False, machine.image, len(machine.axes), machine.core
        )
    except firmware.BuildError as why:
        raise Misfit(f"{machine.file}: {why}") from None
    print(report)


def libraries() -> list[Path]:
    """The folders in which Yosys finds the modules below the top."""
    return sorted({path.parent for path in (ROOT / "rtl").rglob("*.sv")}) + cores()


def synthesise(design: Design, folder: Path) -> Path:
    """The netlist of the top."""
    netlist, part = folder / "netlist.json", design.board.part
    top = (folder / "top.sv").relative_to(ROOT)
    cells = "+/ecp5/cells_bb.v" if part.family == "ecp5" else "+/ice40/cells_sim.v"
    passes = [
        f"read_verilog -lib {cells}",
        f"read_verilog -sv {top}",
        f"hierarchy -check -top top {' '.join(f'-libdir {each}' for each in libraries())}",
        f"synth_{part.family} {part.synthesis} -top top -json {netlist.relative_to(ROOT)}",
    ]
    command = [sys.executable, ROOT / "tools" / "yosys.py", "; ".join(passes)]
    run(command, "synthesis", folder / "synthesis.log")
    return netlist


def place_command(design: Design, folder: Path, netlist: Path, seed: int) -> list[object]:
    """The command of nextpnr, with paths from the root: a YoWASP tool has a /tmp of its own."""
    part, here = design.board.part, folder.relative_to(ROOT)
    pins = here / CONSTRAINTS[part.family]
    speed = ["--speed", part.speed] if part.speed else []
    written = ["--lpf", pins, "--textcfg"] if part.family == "ecp5" else ["--pcf", pins, "--asc"]
    return [
        TOOLS / f"yowasp-nextpnr-{part.family}",
        *(f"--{part.device}", "--package", part.package, *speed, *part.place),
        *("--json", netlist.relative_to(ROOT), *written, here / "placed"),
        *("--freq", design.board.node_hz / 1e6, "--seed", seed, "--report", here / "report.json"),
    ]


def place(design: Design, folder: Path, netlist: Path, seed: int) -> None:
    """Place and route; a clock that is not reached is an error."""
    log = folder / "place_and_route.log"
    try:
        run(place_command(design, folder, netlist, seed), "place and route", log)
    except SynthesisError as why:
        if too_much := overfull(log):
            raise SynthesisError(f"the design does not fit: it needs {too_much}") from None
        raise why


def pack(design: Design, folder: Path) -> Path:
    """The bitstream; for a serial core the image of the flash, with the firmware behind it."""
    bitstream, here = folder / BITSTREAM, folder.relative_to(ROOT)
    ecp5 = design.board.part.family == "ecp5"
    command = ["yowasp-ecppack", "--compress"] if ecp5 else ["yowasp-icepack"]
    words = [TOOLS / command[0], *command[1:], here / "placed", here / BITSTREAM]
    run(words, "packing", folder / "pack.log")
    if design.machine.core == "serial":
        program = (folder / f"{firmware_stem(design.machine)}.bin").read_bytes()
        content, start = bitstream.read_bytes(), design.firmware_address
        if len(content) > start:
            raise SynthesisError(f"the bitstream has {len(content)} bytes, the firmware is at {start}")
        bitstream.write_bytes(content.ljust(start, b"\xff") + program)
    return bitstream


def used(design: Design, folder: Path) -> str:
    """What nextpnr reports: LUT or logic cells, block RAM, MHz."""
    report = json.loads((folder / "report.json").read_text())
    cells = {
        "ecp5": {"LUT": "TRELLIS_COMB", "flip-flops": "TRELLIS_FF", "block RAM": "DP16KD"},
        "ice40": {"logic cells": "ICESTORM_LC", "block RAM": "ICESTORM_RAM"},
    }[design.board.part.family]
    words = [
        f"{report['utilization'][cell]['used']} of {report['utilization'][cell]['available']} {name}"
        for name, cell in cells.items()
    ]
    mhz = min(clock["achieved"] for clock in report["fmax"].values())
    return f"{', '.join(words)}, {mhz:.1f} MHz of {design.board.node_hz / 1e6:g}"


def state(folder: Path, made: Sequence[str]) -> str:
    """A hash of all that goes into the bitstream."""
    sources = sorted((ROOT / "rtl").rglob("*.sv")) + [ROOT / "requirements.lock", Path(__file__)]
    sources += [folder / name for name in made] + sorted(folder.glob("*.hex"))
    found = hashlib.sha256()
    for path in sources:
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()


def bitstream(design: Design, seed: int, say: Callable[[str], None]) -> Path:
    """The bitstream of a machine on a board; nothing is built if nothing has changed."""
    folder = write(design)
    say(f"{design.name}: {shown(folder / 'wiring.html')}")
    make_firmware(design, folder)
    note, now = folder / "note", f"{state(folder, list(files(design)))} seed {seed}"
    if note.is_file() and note.read_text() == now and (folder / BITSTREAM).is_file():
        return folder / BITSTREAM
    note.unlink(missing_ok=True)
    say(f"{design.name}: synthesis (log: {shown(folder / 'synthesis.log')})")
    netlist = synthesise(design, folder)
    log = shown(folder / "place_and_route.log")
    say(f"{design.name}: place and route for {design.board.node_hz / 1e6:g} MHz (log: {log})")
    place(design, folder, netlist, seed)
    made = pack(design, folder)
    note.write_text(now)
    return made


def chosen(board_name: str, machine_name: str) -> tuple[Board, Machine]:
    """The board and the machine that are named; if one is missing, all that there are."""
    if not board_name or not machine_name:
        rows = [f"  make board BOARD={d.board.name} MACHINE={d.machine.name}" for d in fitting()]
        raise Misfit("say which board and which machine:\n" + "\n".join(rows))
    return boards.named(board_name), machines.named(machine_name)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--board", default="", help="a folder of constraints/")
    parser.add_argument("--machine", default="", help="a name of constraints/machines, or a file")
    parser.add_argument("--seed", type=int, default=1, help="of the placement")
    parser.add_argument("--only-files", action="store_true", help="run no tool")
    options = parser.parse_args()
    say = lambda words: print(f"--- {words}", flush=True)
    try:
        design = fit(*chosen(options.board, options.machine))
        if options.only_files:
            print(shown(write(design)))
            return
        made = bitstream(design, options.seed, say)
    except (Misfit, SynthesisError) as why:
        sys.exit(f"board: {why}")
    print(f"{design.name}: {shown(made)}: {used(design, made.parent)}")


if __name__ == "__main__":
    main()

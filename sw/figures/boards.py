# SPDX-License-Identifier: Apache-2.0
"""Figure of the boards: each machine on each board that it is wired for and fits, as `make board`
builds it.
"""

from collections.abc import Callable

from boards import build
from boards.fit import Design
from boards.generate import files
from boards.toml_file import Misfit
from figures.common import Figure, Quick, console, seeds
from figures.synthesis import PLACEMENTS, SynthesisError


def generated(design: Design, _seed: int) -> str:
    """Why the files that are made before any tool runs are not complete; empty if they are."""
    found = {"top.sv", "wiring.svg", "wiring.html", design.board.part.family.constraints}
    missing = sorted(found - set(files(design)))
    return f"{missing[0]} is missing" if missing else ""


def built(design: Design, seed: int) -> str:
    """Why a design has no bitstream or misses its clock at one of the seeds; empty if it is good. A
    part that no open tool places has a netlist.
    """
    build.check_tools(design)
    folder = build.write(design)
    build.make_firmware(design, folder)
    netlist = build.synthesise(design, folder)
    if design.board.part.family.placer is None:
        return ""
    needed = design.board.node_hz / 1e6
    tries = [build.place(design, folder, netlist, one)[0] for one in seeds(seed, PLACEMENTS)]
    build.pack(design, folder)
    console.print(f"{design.name}: {', '.join(f'{mhz:.1f}' for mhz in tries)} MHz")
    return f"{min(tries):.1f} MHz, {needed:g} are needed" if min(tries) < needed else ""


def boards_failed(places: bool = True, seed: int = 1) -> float:
    """Builds that fail; `places` runs the tools, otherwise only the files are made."""
    check: Callable[[Design, int], str] = built if places else generated
    designs, failed = build.fitting()[0], 0
    for design in designs:
        try:
            why = check(design, seed)
        except (Misfit, SynthesisError) as error:
            why = str(error)
        if why:
            failed += 1
            console.print(f"{design.name}: {why}", markup=False, highlight=False)
    console.print(f"{failed} of {len(designs)} builds failed")
    return float(failed)


FIGURES = {
    "boards_failed": Figure(
        boards_failed,
        "builds",
        "each machine on each board that it fits, as `make board` builds it: bitstreams that are "
        "not made or miss the clock of the board at one of three placement seeds; of the Arty A7, "
        "which no open tool places, netlists that are not made",
        "0",
        Quick({"places": False}, "each machine is fitted to its boards and its files are made"),
        0,
    ),
}

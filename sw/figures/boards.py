# SPDX-License-Identifier: Apache-2.0
"""Figures of the boards: each machine on each board that it is wired for and fits, as `make board`
builds it, and how much of two small parts the mill takes.
"""

from collections.abc import Callable

from boards import board as boards
from boards import build, placements
from boards import machine as machines
from boards.fit import Design, fit
from boards.generate import files
from boards.toml_file import Misfit
from figures.common import Figure, Quick, console, seeds
from figures.synthesis import PLACEMENTS, SynthesisError

SMALL = ("counter_box", "relay")  # machines on an iCEBreaker


def generated(design: Design, _seed: int) -> str:
    """Why the files that are made before any tool runs are not complete; empty if they are."""
    found = {"top.sv", "wiring.svg", "wiring.html", design.board.part.family.constraints}
    missing = sorted(found - set(files(design)))
    return f"{missing[0]} is missing" if missing else ""


def told(design: Design, seed: int) -> placements.Build:
    """What the record says of a design after the placement of the seeds that it lacks."""
    say: placements.Say = lambda text: console.print(text, markup=False, highlight=False)
    known = placements.measured(design, seeds(seed, PLACEMENTS), say)
    tries = [known.seeds[one] for one in seeds(seed, PLACEMENTS) if one in known.seeds]
    if tries:
        words = ", ".join(one.failed or f"{one.mhz:.1f} MHz ({one.date})" for one in tries)
        say(f"{design.name}: {words}")
    return known


def built(design: Design, seed: int) -> str:
    """Why a design has no bitstream or misses its clock at a seed; empty if it is good."""
    return placements.too_slow(design, told(design, seed), seeds(seed, PLACEMENTS))


def board_small_mhz(places: bool = True, seed: int = 1) -> float:
    """The slowest of the two small boxes; without a placement the clock that the board gives."""
    designs = [fit(boards.named("icebreaker"), machines.named(name)) for name in SMALL]
    if not places:
        return min(design.board.node_hz / 1e6 for design in designs if not generated(design, seed))
    wanted = seeds(seed, PLACEMENTS)
    return min(placements.worst_mhz(told(design, seed), wanted) for design in designs)


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


def mill_pct(board: str, packs: bool = True) -> float:
    """Share of the LUT of a board's part that the mill takes, in percent: after packing, or by the
    estimate of `make board`.
    """
    design = fit(boards.named(board), machines.named("mill"))
    used, available = design.estimate.lut, design.board.part.lut
    if packs:
        build.check_tools(design)
        folder = build.write(design)
        build.make_firmware(design, folder)
        found = build.counted(design, folder, build.synthesise(design, folder))
        console.print(f"{design.name}: {build.used(design, found)}")
        cell = found[design.placer.used["LUT"]]
        used, available = cell["used"], cell["available"]
    return 100 * used / available


def board_mill_i5_pct(packs: bool = True) -> float:
    return mill_pct("colorlight_i5", packs)


def board_mill_tang_pct(packs: bool = True) -> float:
    return mill_pct("tang_nano_20k", packs)


def mill(measure: Callable[..., float], words: str, bound: str) -> Figure:
    """The figure of the mill on a board."""
    return Figure(
        measure,
        "%",
        f"share of the LUT of {words} that the three-axis mill takes (steppers, A/B/Z scales with "
        "index, homing, limits, firmware in block RAM), after packing by nextpnr, nothing placed",
        bound,
        Quick({"packs": False}, "the estimate of make board, no synthesis"),
        1,
    )


FIGURES = {
    "board_mill_i5_pct": mill(board_mill_i5_pct, "a Colorlight i5 (LFE5U-25F)", "<= 50"),
    "board_mill_tang_pct": mill(board_mill_tang_pct, "a Tang Nano 20K (GW2AR-18)", "<= 70"),
    "board_small_mhz": Figure(
        board_small_mhz,
        "MHz",
        "highest clock of the counter box and of the relay on an iCEBreaker (iCE40 UP5K), as `make "
        "board` builds them: the slower one, the worst of three placement seeds each",
        ">= 24",
        Quick({"places": False}, "their files are made; the clock that the board gives", ">= 18"),
        1,
    ),
    "boards_failed": Figure(
        boards_failed,
        "builds",
        "each machine on each board that it fits, as `make board` builds it: bitstreams that are "
        "not made or miss the clock of the board at one of three placement seeds; of the Arty A7, "
        "which no open tool places, netlists that are not made; a placement that is in "
        "docs/placements.toml is made again only if nextpnr sees another circuit, other pins or "
        "options",
        "0",
        Quick({"places": False}, "each machine is fitted to its boards and its files are made"),
        0,
    ),
}

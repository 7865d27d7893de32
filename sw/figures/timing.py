# SPDX-License-Identifier: Apache-2.0
"""The timing of each build that ships, over ten placement seeds, as a campaign, and the table of
its results in docs/boards.md.

    make soak K=timing                    places all of them, for hours
    python -m figures.timing [RESULTS]    writes the table from what is done so far of this version
"""

import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from boards import build as boards
from boards.fit import Design
from campaigns.campaign import Campaign, Counts, Result
from campaigns.store import Store
from campaigns.version import commit, version
from figures import area
from figures.synthesis import (
    BUILD,
    ECP5,
    NEXTPNR_ECP5,
    NEXTPNR_ICE40,
    UP5K,
    netlist_of,
    placed,
    source_of,
)
from tables import made_files
from twin import build
from twin.build import ROOT

SEEDS = 10
PAGE = ROOT / "docs" / "boards.md"
BEGIN, END = "<!-- timing -->", "<!-- /timing -->"
RESULTS = "build/soak"
NAME = "timing"


@dataclass(frozen=True)
class Build:
    """A build that ships: how its netlist is made, where it is placed, and the clock that it must
    reach.
    """

    words: str
    netlist: Callable[[], Path]
    nextpnr: Sequence[object]
    part: Sequence[str]
    clock_mhz: float
    options: tuple[object, ...]


ALONE = ("--lpf-allow-unconstrained", "--out-of-context")  # a node has more ports than pads
FREE = ("--pcf-allow-unconstrained",)


def of_node(parameters: area.Parameters) -> Callable[[], Path]:
    return lambda: netlist_of(source_of("node"), parameters, "ecp5", 1)


def of_board(design: Design) -> Build:
    """A machine on a board with its pins, part and clock, as `make board` builds it."""
    folder = boards.OUT / design.name

    def netlist() -> Path:
        boards.make_firmware(design, boards.write(design))
        return boards.synthesise(design, folder)

    return Build(
        f"`{design.machine.name}` on the board `{design.board.name}`, with its pins",
        netlist,
        boards.placer(design).nextpnr,
        boards.chip(design),
        design.board.node_hz / 1e6,
        tuple(boards.pinned(design, folder)),
    )


@cache
def builds() -> dict[str, Build]:
    """All builds that ship, the shortest first; this reads the files of all boards."""
    return {
        "relay": Build(
            "relay, 16 orders, iCE40 UP5K",
            lambda: netlist_of(source_of("relay"), {"K": 16}, "ice40", 1),
            *(NEXTPNR_ICE40, UP5K, 24.0, FREE),
        ),
        "counter_box": Build(
            "node that counts, iCE40 UP5K",
            area.counter_box,
            *(NEXTPNR_ICE40, UP5K, 20.0, (*FREE, *area.up5k().place)),
        ),
        "s0_node": Build(
            "S0 node, LFE5U-25F-6", of_node(area.S0_NODE), NEXTPNR_ECP5, ECP5, 60.0, ALONE
        ),
        "node8_step": Build(
            "node of 8 step axes, LFE5U-25F-6",
            of_node({**area.STEP_AXES, "AXES": 8}),
            *(NEXTPNR_ECP5, ECP5, 60.0, ALONE),
        ),
        "node4_sine": Build(
            "node of 4 sine axes, LFE5U-25F-6",
            of_node({**area.SINE_AXES, "AXES": 4}),
            *(NEXTPNR_ECP5, ECP5, 60.0, ALONE),
        ),
        **{design.name: of_board(design) for design in boards.placeable()},
    }


def netlist_once(name: str) -> Path:
    """The netlist of a build, made once for each version of the sources."""

    def make(folder: Path) -> None:
        build.firmware()
        shutil.copy(builds()[name].netlist(), folder / "netlist.json")

    return build.made_once(BUILD / f"{NAME}-{name}-{version()}", "netlist.json", make)


def placement(part: int, seed: int) -> Counts:
    """One placement: the first ten parts are those of the first build."""
    name, number = list(builds())[part // SEEDS], part % SEEDS
    one = builds()[name]
    netlist = netlist_once(name)
    with TemporaryDirectory(dir=BUILD) as folder:
        own = Path(shutil.copy(netlist, folder))
        first = seed - part  # of the campaign
        mhz, _ = placed(own, one.nextpnr, one.part, one.clock_mhz, first + number, *one.options)
    return {"placements": 1, "slow": int(mhz < one.clock_mhz), f"{name}_ns": 1000 / mhz}


def rows(results: Mapping[int, Result]) -> list[str]:
    """The table: the worst and the best of the placements that are done."""
    heads = ("build", "clock, MHz", "placements", "worst, MHz", "best, MHz")
    found = ["", "| " + " | ".join(heads) + " |", "| --- | --- | --- | --- | --- |"]
    for name, one in builds().items():
        times = [r.counts.get(f"{name}_ns") for r in results.values()]
        mhz = sorted(1000 / float(ns) for ns in times if ns is not None)
        cells = (f"{mhz[0]:.1f}", f"{mhz[-1]:.1f}") if mhz else ("not measured yet", "")
        row = (one.words, f"{one.clock_mhz:g}", f"{len(mhz)} of {SEEDS}", *cells)
        found.append("| " + " | ".join(row) + " |")
    return [*found, "", f"Measured on commit {commit()}.", ""]


def main() -> None:
    store = Store(sys.argv[1] if len(sys.argv) > 1 else RESULTS)
    parts = range(campaign().parts)
    found = store.results(NAME, version(), 1, parts)
    PAGE.write_text(made_files.filled(PAGE, BEGIN, END, rows(found)), encoding="utf-8")
    print(f"{PAGE.relative_to(ROOT)}: {len(found)} of {len(parts)} placements")


@cache
def campaign() -> Campaign:
    """The campaign of all builds."""
    return Campaign(
        f"placements of the {len(builds())} builds that ship, {SEEDS} seeds each; failed: those "
        "slower than the clock of their build; the count is the longest period",
        placement,
        parts=SEEDS * len(builds()),
        tried="placements",
        failed="slow",
        largest=tuple(f"{name}_ns" for name in builds()),
    )


def __getattr__(name: str) -> dict[str, Campaign]:
    """CAMPAIGNS, made when it is asked for: a wrong board file must not break other figures."""
    if name == "CAMPAIGNS":
        return {NAME: campaign()}
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


if __name__ == "__main__":
    main()

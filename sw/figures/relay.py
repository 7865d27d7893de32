# SPDX-License-Identifier: Apache-2.0
"""Figures of the relay: how exact its correction is, how late and how reliable its edges are, and
how much of an iCE40 UP5K it takes.

The campaign of 10^9 edges is `make soak K=relay`.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from campaigns.campaign import Campaign
from figures.common import Figure, Quick, bar, console, seeds, shares
from figures.synthesis import (
    ELABORATED,
    NEXTPNR_ICE40,
    UP5K,
    elaborated,
    mhz_words,
    netlist_of,
    placements,
    source_of,
)
from twin.build import ROOT, run, simulation

RELAY = ROOT / "rtl" / "relay.sv"
DRIVER = Path(__file__).with_name("relay_run.cpp")
AS_MEASURED: dict[str, Any] = {
    "K": 16,
    "BAUD": 3_000_000,
}  # a fast UART, so that runs need not wait for it
CLK_MHZ = 48
EDGES = 10**7
SHARE = 10**6  # edges of one run, each with a seed, and so a ring, of its own
POINTS = 2048
RINGS = 4
RATES_MHZ = (24, 30, 36, 40, 44, 46, 47, 47.5)


def relay_run(*words: object) -> dict[str, float]:
    """What the program prints, {name: number}."""
    printed = run([simulation(DRIVER, RELAY, **AS_MEASURED), *words], "relay_run").split()
    return dict(zip(printed[1::2], map(float, printed[::2])))


def harmonic_arith_arcsec(points: int = POINTS, rings: int = RINGS, seed: int = 1) -> float:
    """Largest difference from float64 at so many positions per turn and ring, all 16 orders on,
    32768 counts per turn.
    """
    return max(relay_run("accuracy", points, one)["arcsec"] for one in seeds(seed, rings))


def relay_latency_us(rings: int = RINGS, seed: int = 1) -> float:
    """Longest of 20 000 edges per ring, without filter, from the pin of the read head to the pin of
    the controller; of two edges that follow one, the second.
    """
    found = [relay_run("latency", one) for one in seeds(seed, rings)]
    console.print(f"{sum(one['answered'] for one in found):.0f} edges had an edge as their answer")
    return max(one["clk"] for one in found) / CLK_MHZ


def edges_run(mhz: float, edges: int, seed: int) -> dict[str, float]:
    """What the program counts over so many edges, {name: number}."""
    return relay_run("edges", mhz * 1e6, edges, seed)


def count_errors(edges: int = EDGES, mhz: float = 24, seed: int = 1) -> float:
    """Cycles in which the output is not the corrected input, over so many edges whose rate is
    independent of the clock.
    """
    totals: dict[str, float] = {}
    with bar(f"{edges:.0e} edges") as progress:
        task = progress.add_task("", total=edges)
        for size, number in shares(edges, SHARE, seed):
            for name, value in edges_run(mhz, size, number).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["edges"])
    console.print(
        ", ".join(f"{value:.0f} {name}" for name, value in totals.items() if name != "flags")
    )
    return totals["wrong"]


def relay_count_errors(edges: int = EDGES, seed: int = 1) -> float:
    """Edges at 24 million per second with reversals, a ring for each million."""
    return count_errors(edges, seed=seed)


def relay_edge_mhz(edges: int = SHARE, rates: Sequence[float] = RATES_MHZ, seed: int = 1) -> float:
    """The highest of a row of edge rates at which so many edges leave no wrong count."""
    best = 0.0
    for mhz in rates:
        if count_errors(edges, mhz, seed):
            break
        best = mhz
    return best


@cache
def up5k(first: int) -> dict[str, float]:
    netlist = netlist_of(source_of("relay"), {"K": 16}, "ice40", 1)
    tries = placements(netlist, NEXTPNR_ICE40, UP5K, 24, first, "--pcf-allow-unconstrained")
    console.print(f"placements: {mhz_words(tries)}")
    fmax, used = min(tries, key=lambda one: one[0])
    part = {
        name: used[cell]
        for name, cell in (("lc", "ICESTORM_LC"), ("ram", "ICESTORM_RAM"), ("dsp", "ICESTORM_DSP"))
    }
    console.print(
        ", ".join(f"{use['used']} of {use['available']} {name}" for name, use in part.items())
        + f", {fmax:.1f} MHz"
    )
    return {"lc": part["lc"]["used"], "lc_of": part["lc"]["available"], "fmax_mhz": fmax}


def on_up5k(name: str, place: bool, seed: int) -> float:
    """Of the whole relay, K = 16, with UART and flash; the worst of three placements."""
    if not place:
        return elaborated(source_of("relay"), {"K": 16})
    return float(up5k(seed)[name])


def relay_up5k_lc(place: bool = True, seed: int = 1) -> float:
    return on_up5k("lc", place, seed)


def relay_up5k_mhz(place: bool = True, seed: int = 1) -> float:
    return on_up5k("fmax_mhz", place, seed)


FIGURES = {
    "harmonic_arith_arcsec": Figure(
        harmonic_arith_arcsec,
        "arcsec",
        "largest difference of the relay's correction from float64, all 16 orders on, 2048 "
        "positions of each of four rings",
        "<= 0.01",
        Quick({"points": 64, "rings": 1}, "64 positions of one ring"),
        4,
    ),
    "relay_latency_us": Figure(
        relay_latency_us,
        "us",
        "edge in to edge out at 48 MHz, 16 orders, no input filter, longest of 80 000 edges but "
        "for the few that the correction takes back",
        "<= 1",
        Quick({"rings": 1}, "one ring"),
        note="the paper polls every 400",
    ),
    "relay_edge_mhz": Figure(
        relay_edge_mhz,
        "MHz",
        "highest input edge rate at which 10^6 edges leave no wrong count, at 48 MHz",
        ">= 24",
        Quick({"edges": 50_000, "rates": (24, 47.5)}, "50 000 edges at 24 and at 47.5 MHz"),
        1,
        "the paper 3",
    ),
    "relay_count_errors": Figure(
        relay_count_errors,
        "cycles",
        "cycles in which the output is not the corrected input, 10^7 edges at 24 MHz with "
        "reversals, ten rings",
        "0",
        Quick({"edges": 200_000}, "200 000 edges of one ring"),
        0,
    ),
    "relay_up5k_lc": Figure(
        relay_up5k_lc,
        "LC",
        "logic cells of the whole relay, 16 orders, on an iCE40 UP5K, which has 5280",
        "<= 5280",
        ELABORATED,
        0,
    ),
    "relay_up5k_mhz": Figure(
        relay_up5k_mhz,
        "MHz",
        "highest clock of the same, worst of placement seeds 1 to 3",
        ">= 24",
        ELABORATED,
        1,
    ),
}

CAMPAIGNS = {
    "relay": Campaign(
        "edges into the relay at 24 MHz with reversals, a ring for each million; failed: cycles in "
        "which the output is not the corrected input",
        lambda part, seed: edges_run(24, SHARE, seed),
        parts=1000,
        tried="edges",
        failed="wrong",
    )
}

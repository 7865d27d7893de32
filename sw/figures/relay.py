# SPDX-License-Identifier: Apache-2.0
"""Figures of the relay: how exact its harmonics are, how late, how fast and how sure its edges, and
what it takes of an iCE40 UP5K.

The soak of 10^9 edges is `make soak K=relay`.
"""

from functools import cache
from pathlib import Path

from figures.common import Figure, bar, console
from figures.synthesis import netlist_of, placed, source_of
from twin.build import run, simulation

RELAY = Path(__file__).resolve().parents[2] / "rtl" / "relay.sv"
DRIVER = Path(__file__).with_name("relay_run.cpp")
AS_MEASURED = {"K": 16, "BAUD": 3_000_000}  # a fast line, so that runs need not wait for it
CLK_MHZ = 48
EDGES = 10**7
SHARE = 10**6  # edges of one run, each with a seed, and so a ring, of its own
POINTS = 2048
RINGS = 4
UP5K = ["--up5k", "--package", "sg48"]
PLACEMENTS = (1, 2, 3)  # seeds
RATES_MHZ = (24, 30, 36, 40, 44, 46, 47, 47.5)


def relay_run(*words):
    """What the program prints, {name: number}."""
    told = run([simulation(DRIVER, RELAY, **AS_MEASURED), *words], "relay_run").split()
    return dict(zip(told[1::2], map(float, told[::2])))


def harmonic_arith_arcsec():
    """Largest difference from float64 at 2048 places of the turn each of four rings, all 16 orders
    on, 32768 counts a turn.
    """
    return max(relay_run("accuracy", POINTS, seed)["arcsec"] for seed in range(1, RINGS + 1))


def relay_latency_us():
    """Longest of 20 000 edges, without filter, from the pin of the read head to the pin of the
    controller.
    """
    return max(relay_run("latency", seed)["clk"] for seed in range(1, RINGS + 1)) / CLK_MHZ


def count_errors(edges=EDGES, mhz=24):
    """Places at which the output is not the corrected input, over so many edges at a rate that is
    no multiple of the clk.
    """
    totals = {}
    with bar(f"{edges:.0e} edges") as progress:
        task = progress.add_task("", total=edges)
        for seed, first in enumerate(range(0, edges, SHARE), start=1):
            for name, value in relay_run(
                "edges", mhz * 1e6, min(SHARE, edges - first), seed
            ).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["edges"])
    console.print(
        ", ".join(f"{value:.0f} {name}" for name, value in totals.items() if name != "flags")
    )
    return totals["wrong"]


def relay_count_errors():
    """10^7 edges at 24 million a second with reversals, ten rings."""
    return count_errors()


def relay_edge_mhz():
    """The highest of a row of edge rates at which 10^6 edges leave no wrong count."""
    best = 0.0
    for mhz in RATES_MHZ:
        if count_errors(SHARE, mhz):
            break
        best = mhz
    return best


@cache
def up5k():
    netlist = netlist_of(source_of("relay"), {"K": 16}, "ice40", 1)
    tries = [
        placed(netlist, "ice40", UP5K, 24, seed, "--pcf-allow-unconstrained") for seed in PLACEMENTS
    ]
    console.print("placements: " + ", ".join(f"{mhz:.1f}" for mhz, _ in tries) + " MHz")
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


def relay_up5k_lc():
    """Logic cells of the whole relay, K = 16, with line and flash."""
    return float(up5k()["lc"])


def relay_up5k_mhz():
    """The fastest clk that nextpnr promises for each of three placements."""
    return up5k()["fmax_mhz"]


FIGURES = {
    "harmonic_arith_arcsec": Figure(
        harmonic_arith_arcsec,
        "arcsec",
        "correction of the relay against float64, all 16 orders on",
        "<= 0.01",
        lambda value: value <= 0.01,
        4,
    ),
    "relay_latency_us": Figure(
        relay_latency_us,
        "us",
        "edge in to edge out at 48 MHz, K = 16",
        "<= 1 (the paper polls every 400)",
        lambda value: value <= 1,
    ),
    "relay_edge_mhz": Figure(
        relay_edge_mhz,
        "MHz",
        "input edge rate without a lost count at 48 MHz",
        ">= 24 (the paper 3)",
        lambda value: value >= 24,
        1,
    ),
    "relay_count_errors": Figure(
        relay_count_errors,
        "",
        "output that is not the corrected input, 10^7 edges with reversals",
        "0",
        lambda value: value == 0,
        0,
    ),
    "relay_up5k_lc": Figure(
        relay_up5k_lc,
        "LC",
        "whole relay, K = 16, on iCE40 UP5K",
        "<= 5280, all there are",
        lambda value: value <= 5280,
        0,
    ),
    "relay_up5k_mhz": Figure(
        relay_up5k_mhz,
        "MHz",
        "the same, highest clk, worst of placement seeds 1 to 3",
        ">= 24",
        lambda value: value >= 24,
        1,
    ),
}

SOAK = {"relay": lambda: (wrong := count_errors(10**9), wrong == 0)}

# SPDX-License-Identifier: Apache-2.0
"""Figures of the incremental encoder: does it ever count wrong, how large and how fast is the
counter on an iCE40 HX8K.

The soak of 10^9 edges is `make soak K=decoder`.
"""

from functools import cache
from pathlib import Path

from figures.common import Figure, bar, console
from figures.synthesis import synthesise_ice40
from twin.build import run, simulation

ENCODER = Path(__file__).resolve().parents[2] / "rtl" / "decode" / "incremental_encoder.sv"
DRIVER = Path(__file__).with_name("encoder_run.cpp")
EDGES = 10**7
SHARE = 10**6  # edges of one run, each with a seed of its own
SEEDS = range(1, 6)  # of the placement; the figure is the worst of them


def miscounts(edges=EDGES):
    """Clks at which the count was not that of the plain model, over so many edges; each false flag
    or index counts as one more.
    """
    program, totals = simulation(DRIVER, ENCODER), {}
    with bar(f"{edges:.0e} edges") as progress:
        task = progress.add_task("", total=edges)
        for seed, first in enumerate(range(0, edges, SHARE), start=1):
            words = run([program, min(SHARE, edges - first), seed], "encoder_run").split()
            for value, name in zip(words[::2], words[1::2]):
                totals[name] = totals.get(name, 0) + int(value)
            progress.update(task, completed=totals["edges"])
    console.print(", ".join(f"{value} {name}" for name, value in totals.items()))
    return totals["wrong"]


def decoder_miscounts():
    """10^7 edges with jitter and glitches below the filter, random reversals, an index every 1000
    counts.
    """
    return float(miscounts())


@cache
def hx8k():
    """encoder_counter, whose features are those of HostMot2's counter: settings, flags and both
    words read over its bus, filter of up
    to 15 samples, index and probe latch, time of the last edge. The rate of the samples and the
    time itself come from outside."""
    found = [synthesise_ice40("encoder_counter", seed=seed) for seed in SEEDS]
    console.print(
        "encoder_counter: "
        + ", ".join(f"{one['lc']} LC {one['fmax_mhz']:.1f} MHz" for one in found)
    )
    return found


def decoder_hx8k_lc():
    return float(max(one["lc"] for one in hx8k()))


def decoder_hx8k_mhz():
    return min(one["fmax_mhz"] for one in hx8k())


FIGURES = {
    "decoder_miscounts": Figure(
        decoder_miscounts,
        "clk",
        "wrong counts in 10^7 edges: jitter, glitches below the filter, random reversals",
        "0",
        lambda value: value == 0,
        0,
    ),
    "decoder_hx8k_lc": Figure(
        decoder_hx8k_lc,
        "LC",
        "encoder counter with bus, filter, index, probe, flags and time stamp on iCE40 HX8K",
        "< 224 (HostMot2 224)",
        lambda value: value < 224,
        0,
    ),
    "decoder_hx8k_mhz": Figure(
        decoder_hx8k_mhz,
        "MHz",
        "the same, highest clk, worst of five placements",
        "> 129 (HostMot2 129)",
        lambda value: value > 129,
        1,
    ),
}

SOAK = {"decoder": lambda: (wrong := miscounts(10**9), wrong == 0)}

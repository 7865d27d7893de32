# SPDX-License-Identifier: Apache-2.0
"""Figures of the step generator: does it ever lose a step or break a timing, how true are its rate
and its edges, how large
and how fast is it on an iCE40 HX8K.

The soak of 10^8 reversals is `make soak K=steps`.
"""

from functools import cache
from pathlib import Path

from figures.common import Figure, bar, console
from figures.synthesis import synthesise_ice40
from twin.build import run, simulation

ROOT = Path(__file__).resolve().parents[2]
DRIVER = Path(__file__).with_name("steps_run.cpp")
SOURCE = ROOT / "rtl" / "drive" / "step_generator.sv"
REVERSALS = 10**6
SHARE = 10**5  # reversals of one run, each with a seed of its own
RATES = 24  # random speeds; every eighth is the top one, a step each 2 clk


def told(*arguments):
    """{name: value} that the program prints."""
    words = run([simulation(DRIVER, SOURCE), *arguments], "steps_run").split()
    return {name: float(value) for value, name in zip(words[::2], words[1::2])}


@cache
def reversals(count=REVERSALS):
    totals = {}
    with bar(f"{count:.0e} reversals") as progress:
        task = progress.add_task("", total=count)
        for seed, first in enumerate(range(0, count, SHARE), start=1):
            for name, value in told("reversals", min(SHARE, count - first), seed).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["reversals"])
    console.print(", ".join(f"{value:.0f} {name}" for name, value in totals.items()))
    return totals


def steps_lost():
    """Clks at which steps was not what the pins had shown, ends that were not the floor of the
    target, and overruns.
    """
    totals = reversals()
    return totals["lost"] + totals["overruns"]


def step_timing_violations():
    return reversals()["violations"]


@cache
def rates():
    return [told("rate", seed) for seed in range(1, RATES + 1)]


def worst(name):
    runs = rates()
    console.print(
        f"{RATES} speeds from {min(r['rate'] for r in runs):.6f} to {max(r['rate'] for r in runs):.6f} step/clk"
    )
    return max(r[name] for r in runs)


def hx8k(name):
    found = synthesise_ice40("step_generator")
    console.print(f"step_generator: {found['lc']} logic cells, {found['fmax_mhz']:.1f} MHz")
    return float(found[name])


FIGURES = {
    "steps_lost": Figure(
        steps_lost,
        "steps",
        "wire minus reported over 10^6 reversals: random rates, timings, polarity, off and on",
        "0",
        lambda value: value == 0,
        0,
    ),
    "step_timing_violations": Figure(
        step_timing_violations,
        "",
        "high, low, set-up, hold shorter than set, same run",
        "0",
        lambda value: value == 0,
        0,
    ),
    "step_rate_ppm": Figure(
        lambda: worst("ppm"),
        "ppm",
        "average rate against the target's, worst of 24 random speeds over 4 million clk",
        "<= 1",
        lambda value: value <= 1,
        6,
    ),
    "step_jitter_clk": Figure(
        lambda: worst("jitter"),
        "clk",
        "edge on the pin against the ideal line, its 2 clk of latency taken off, "
        "the rounding to whole clk included; worst edge of the same, the timings short enough not to delay one",
        "<= 1",
        lambda value: value <= 1,
        6,
    ),
    "step_hx8k_lc": Figure(
        lambda: hx8k("lc"),
        "LC",
        "step generator with all timings and modes on iCE40 HX8K, settings on ports",
        "< 406 (HostMot2 406)",
        lambda value: value < 406,
        0,
    ),
    "step_hx8k_mhz": Figure(
        lambda: hx8k("fmax_mhz"),
        "MHz",
        "the same, highest clk, placement seed 1",
        "> 74 (HostMot2 74)",
        lambda value: value > 74,
        1,
    ),
}

SOAK = {
    "steps": lambda: (
        totals := reversals(10**8),
        not (totals["lost"] or totals["violations"] or totals["overruns"]),
    )
}

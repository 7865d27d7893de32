# SPDX-License-Identifier: Apache-2.0
"""Figures of the step generator: does it ever lose a step or violate a timing, how exact are its
rate and its edges, and how large and how fast is it on an iCE40 HX8K.

The campaign of 10^8 reversals is `make soak K=steps`.
"""

from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, bar, console, seeds, shares
from figures.synthesis import ELABORATED, elaborated, synthesise_ice40
from twin.build import ROOT, run, simulation

DRIVER = Path(__file__).with_name("steps_run.cpp")
BENCH = Path(__file__).with_name("steps_bench.sv")
SOURCE = ROOT / "rtl" / "drive" / "step_generator.sv"
REVERSALS = 10**6
SHARE = 10**5  # reversals of one run, each with a seed of its own
RATES = 24  # random speeds; every eighth is the highest one, a step every 2 cycles


def steps_run(*arguments: object) -> dict[str, float]:
    """{name: value} that the program prints."""
    words = run([simulation(DRIVER, BENCH), *arguments], "steps_run").split()
    return {name: float(value) for value, name in zip(words[::2], words[1::2])}


@cache
def reversals(count: int = REVERSALS, seed: int = 1) -> dict[str, float]:
    totals: dict[str, float] = {}
    with bar(f"{count:.0e} reversals") as progress:
        task = progress.add_task("", total=count)
        for size, number in shares(count, SHARE, seed):
            for name, value in steps_run("reversals", size, number).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["reversals"])
    console.print(", ".join(f"{value:.0f} {name}" for name, value in totals.items()))
    return totals


def steps_lost(count: int = REVERSALS, seed: int = 1) -> float:
    """Cycles in which `steps` differed from what the pins had shown, ends that were not the floor
    of the target, and overruns.
    """
    totals = reversals(count, seed)
    return totals["lost"] + totals["overruns"]


def step_timing_violations(count: int = REVERSALS, seed: int = 1) -> float:
    return reversals(count, seed)["violations"]


@cache
def rates(count: int, seed: int) -> list[dict[str, float]]:
    return [steps_run("rate", number) for number in seeds(seed, count)]


def worst(name: str, count: int, seed: int) -> float:
    runs = rates(count, seed)
    low, high = (limit(r["rate"] for r in runs) for limit in (min, max))
    console.print(f"{count} speeds from {low:.6f} to {high:.6f} steps per cycle")
    return max(r[name] for r in runs)


def step_rate_ppm(count: int = RATES, seed: int = 1) -> float:
    return worst("ppm", count, seed)


def step_jitter_clk(count: int = RATES, seed: int = 1) -> float:
    return worst("jitter", count, seed)


def hx8k(name: str, place: bool, seed: int) -> float:
    if not place:
        return elaborated(SOURCE)
    found = synthesise_ice40("step_generator", seed=seed)
    console.print(f"step_generator: {found['lc']} logic cells, {found['fmax_mhz']:.1f} MHz")
    return found[name]


def step_hx8k_lc(place: bool = True, seed: int = 1) -> float:
    return hx8k("lc", place, seed)


def step_hx8k_mhz(place: bool = True, seed: int = 1) -> float:
    return hx8k("fmax_mhz", place, seed)


FEW = Quick({"count": 20_000}, "20 000 reversals")
SPEEDS = Quick({"count": 3}, "three speeds")
FIGURES = {
    "steps_lost": Figure(
        steps_lost,
        "steps",
        "steps on the wire minus steps reported over 10^6 reversals: random rates, timings and "
        "polarity, switched off and on",
        "0",
        FEW,
        0,
    ),
    "step_timing_violations": Figure(
        step_timing_violations,
        "",
        "high, low, set-up and hold times shorter than set, in the same run",
        "0",
        FEW,
        0,
    ),
    "step_rate_ppm": Figure(
        step_rate_ppm,
        "ppm",
        "average rate against the target's, worst of 24 random speeds over 4 million cycles",
        "<= 1",
        SPEEDS,
        6,
    ),
    "step_jitter_clk": Figure(
        step_jitter_clk,
        "cycles",
        "edge on the pin against the ideal line, less 2 cycles of latency, with the rounding to "
        "whole cycles; worst edge of the same, all timings short enough not to delay one",
        "<= 1",
        SPEEDS,
        6,
    ),
    "step_hx8k_lc": Figure(
        step_hx8k_lc,
        "LC",
        "step generator (for comparison: without its registers, and without step_lines, which "
        "gives the rates of all axes as the PC gives them to HostMot2) with all timings and modes "
        "on an iCE40 HX8K, placement seed 1",
        "< 406",
        ELABORATED,
        0,
        "HostMot2 406",
    ),
    "step_hx8k_mhz": Figure(
        step_hx8k_mhz,
        "MHz",
        "highest clock of the same, placement seed 1",
        "> 74",
        ELABORATED,
        1,
        "HostMot2 74",
    ),
}


def reversals_of_part(part: int, seed: int) -> Counts:
    counts = steps_run("reversals", SHARE, seed)
    failures = counts["lost"] + counts["violations"] + counts["overruns"]
    return {**counts, "failures": failures}


CAMPAIGNS = {
    "steps": Campaign(
        "reversals of the step generator at random rates, timings and polarities; failed: steps "
        "lost, timings violated, overruns",
        reversals_of_part,
        parts=1000,
        tried="reversals",
        failed="failures",
    )
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of S2 and S3: counts of three scales, and the zero point of a linear motor."""

from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from experiments import s3_zero
from figures.common import Figure, Quick, bar, console, seeds, shares
from twin import build

SEARCHES_A_POWER_UP = 10
PROCESSES = 2


def searched(
    seed: int,
) -> list[
    s3_zero.Search
]:  # in a process of its own: a fork would inherit the progress bar's thread
    return s3_zero.searches(SEARCHES_A_POWER_UP, seed)


def s3_zero_um_max(count: int = 1000, seed: int = 1) -> float:
    """A power-up every ten searches, with another start, other noise, and counts from anywhere."""
    s3_zero.Motor(1)  # builds the twin once
    made = []
    with bar("searches") as progress, ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        task = progress.add_task("", total=count)
        for some in pool.map(searched, seeds(seed, count // SEARCHES_A_POWER_UP)):
            made += some
            progress.advance(task, len(some))
    times = sorted(search.time_s for search in made)
    starts = [search.start_um for search in made]
    above = sum(start > 0 for start in starts)
    zeros = sorted({search.zero_counts for search in made})
    console.print(
        f"{len(made)} searches, {above} from above the index and {len(made) - above} from below, "
        f"from {min(starts):.0f} to {max(starts):.0f} um; {times[len(times) // 2]:.2f} s (median), "
        f"{times[-1]:.2f} s at most; the index scatters by +-0.05 um; the zero is at count "
        f"{', '.join(map(str, zeros))} of the scale"
    )
    return s3_zero.zero_spread(made) * s3_zero.COUNT_M * 1e6


# ------------------------------------------------------------------ S2

DRIVER = Path(__file__).with_name("counts_run.cpp")
BENCH = Path(__file__).with_name("three_axes_bench.sv")
AXES = 3
PULSES = 10**7
SHARE = 10**6  # pulses an axis of one run, each run with a seed of its own
CROSSED = {
    "zero": "the origin",
    "word": "a border of 16 bits",
    "long_word": "one of 31 or 32 bits",
    "whole": "where the register wraps",
}


def counted(seed: int, pulses: int = SHARE, *more: object) -> list[dict[str, int]]:
    """What counts_run prints of each axis: [{name: number}]."""
    command = [build.simulation(DRIVER, BENCH), pulses, seed, *more]
    lines = build.run(command, "counts_run").splitlines()
    return [dict(zip(words[1::2], map(int, words[::2]))) for words in map(str.split, lines[:AXES])]


def s2_count_errors(pulses: int = PULSES, seed: int = 1) -> int:
    build.simulation(DRIVER, BENCH)
    total: list[Counter[str]] = [Counter() for _ in range(AXES)]
    with bar("pulses") as progress, ThreadPoolExecutor(PROCESSES) as pool:
        task = progress.add_task("", total=pulses)
        sizes, numbers = zip(*shares(pulses, SHARE, seed))
        for size, axes in zip(sizes, pool.map(counted, numbers, sizes)):
            for axis, counts in zip(total, axes):
                axis.update(counts)
            progress.advance(task, size)
    for number, axis in enumerate(total):
        crossed = ", ".join(f"{axis[name]} times {words}" for name, words in CROSSED.items())
        console.print(
            f"axis {number}: {axis['pulses']} pulses, {axis['reversals']} reversals, "
            f"read {axis['checks']} times; crossed {crossed}: {axis['wrong']} wrong"
        )
    return sum(axis["wrong"] for axis in total)


FIGURES = {
    "s2_count_errors": Figure(
        s2_count_errors,
        "counts",
        "wrong counts over 10^7 pulses on each of three axes, random directions and speeds, "
        "through every overflow",
        "0",
        Quick({"pulses": 200_000}, "200 000 pulses"),
        0,
    ),
    "s3_zero_um_max": Figure(
        s3_zero_um_max,
        "um",
        "spread of the zero of a linear motor over 1000 searches from anywhere within 1 mm, in "
        "counts of 1 um, the index in the middle of a count with +-0.05 um of scatter",
        "0",
        Quick({"count": 20}, "20 searches"),
        1,
        "the paper +-2",
    ),
}


def pulses_of_part(part: int, seed: int) -> Counts:
    total = Counter[str]()
    for axis in counted(seed):
        total.update(axis)
    return dict(total)


ZERO_S3 = 0  # count of the scale at the mark


def searches_of_part(part: int, seed: int) -> Counts:
    made = s3_zero.searches(SEARCHES_A_POWER_UP, seed)
    failed = sum(search.zero_counts != ZERO_S3 for search in made)
    slowest = max(search.time_s for search in made)
    return {"homings": len(made), "failed": failed, "slowest search in s": slowest}


CAMPAIGNS = {
    "homing_s3": Campaign(
        "zero searches of the linear motor of S3 from anywhere within 1 mm; failed: another count",
        searches_of_part,
        parts=10**5 // SEARCHES_A_POWER_UP,
        tried="homings",
        failed="failed",
        largest=("slowest search in s",),
    ),
    "s2_counts": Campaign(
        "pulses of three scales at random speeds, through every overflow; failed: wrong counts",
        pulses_of_part,
        parts=1000,
        tried="pulses",
        failed="wrong",
    ),
}

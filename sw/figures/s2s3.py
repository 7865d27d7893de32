# SPDX-License-Identifier: Apache-2.0
"""Figures of S2 and S3: counts of three scales, and the zero point of a linear motor."""

from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from experiments import s3_zero
from figures.common import Figure, bar, console
from twin import build

SEARCHES_A_POWER_UP = 10
PROCESSES = 2


def searched(seed):  # in a process of its own: a fork would inherit the progress bar's thread
    return s3_zero.searches(SEARCHES_A_POWER_UP, seed)


def s3_zero_um_max(count=1000):
    """A power-up every ten searches: other rest, other noise, and counts that begin anywhere."""
    s3_zero.Motor(1)  # builds the twin once
    made = []
    with bar("searches") as progress, ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        task = progress.add_task("", total=count)
        for some in pool.map(searched, range(1, count // SEARCHES_A_POWER_UP + 1)):
            made += some
            progress.advance(task, len(some))
    times = sorted(search.time_s for search in made)
    starts = [search.start_um for search in made]
    above, zeros = (
        sum(start > 0 for start in starts),
        sorted({search.zero_counts for search in made}),
    )
    console.print(
        f"{len(made)} searches, {above} from above the mark and {len(made) - above} from below, from {min(starts):.0f} to "
        f"{max(starts):.0f} um; {times[len(times) // 2]:.2f} s (median), {times[-1]:.2f} s at most; the mark scatters by "
        f"+-0.05 um; the zero lies at count {', '.join(map(str, zeros))} of the scale"
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


def counted(seed, pulses=SHARE, *more):
    """What counts_run tells of each axis: [{name: number}]."""
    command = [build.simulation(DRIVER, BENCH), pulses, seed, *more]
    told = build.run(command, "counts_run").splitlines()
    return [dict(zip(words[1::2], map(int, words[::2]))) for words in map(str.split, told[:AXES])]


def s2_count_errors(pulses=PULSES):
    build.simulation(DRIVER, BENCH)
    total = [Counter() for _ in range(AXES)]
    with bar("pulses") as progress, ThreadPoolExecutor(PROCESSES) as pool:
        task = progress.add_task("", total=pulses)
        for axes in pool.map(counted, range(1, pulses // SHARE + 1)):
            for axis, told in zip(total, axes):
                axis.update(told)
            progress.advance(task, SHARE)
    for number, axis in enumerate(total):
        crossed = ", ".join(f"{axis[name]} times {words}" for name, words in CROSSED.items())
        console.print(
            f"axis {number}: {axis['pulses']} pulses, {axis['reversals']} reversals, read {axis['checks']} times; "
            f"crossed {crossed}: {axis['wrong']} wrong"
        )
    return sum(axis["wrong"] for axis in total)


FIGURES = {
    "s2_count_errors": Figure(
        s2_count_errors,
        "counts",
        "counts wrong over 10^7 pulses on each of three axes, random ways and speeds, "
        "through every overflow",
        "0",
        lambda v: v == 0,
        0,
    ),
    "s3_zero_um_max": Figure(
        s3_zero_um_max,
        "um",
        "spread of the zero of a linear motor over 1000 searches from anywhere within 1 mm, in "
        "counts of 1 um",
        "0 (paper +-2)",
        lambda v: v == 0,
        1,
    ),
}


def soaked(name, *arguments):
    value = FIGURES[name].measure(*arguments)
    return value, FIGURES[name].good(value)


SOAK = {
    "s2_counts": lambda: soaked("s2_count_errors", 10**9),
    "s3_zero": lambda: soaked("s3_zero_um_max", 10_000),
}

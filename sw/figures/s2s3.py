# SPDX-License-Identifier: Apache-2.0
"""Figures of S2 and S3: counts of three scales, and the zero point of a linear motor."""

import math
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from experiments import s3_zero
from figures.common import PROCESSES, Figure, Quick, bar, console, in_processes, seeds, shares
from moire.client.index_survey import PASSES
from twin import build

SEARCHES_A_POWER_UP = 10
WARNED_PCT = 5  # of the motors; a survey that always warned would be of no use


def searched(seed: int) -> list[s3_zero.Search]:
    return s3_zero.searches(SEARCHES_A_POWER_UP, seed)


def s3_zero_um_max(count: int = 1000, seed: int = 1) -> float:
    """A power-up every ten searches, with another start, other noise, and counts from anywhere."""
    s3_zero.Motor(1)  # builds the twin once
    power_ups = seeds(seed, count // SEARCHES_A_POWER_UP)
    sizes = [SEARCHES_A_POWER_UP] * len(power_ups)
    made = [
        search for some in in_processes("searches", searched, sizes, power_ups) for search in some
    ]
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


MOTORS, SEARCHES_A_MOTOR = 200, 20


def s3_zero_any_mark(
    motors: int = MOTORS,
    searches: int = SEARCHES_A_MOTOR,
    passes: int = PASSES,
    seed: int = 1,
) -> float:
    """Surveys the mark of each motor and searches its zero; searches that found another count than
    most, of the motors that had no warning. Not a number if more than WARNED_PCT have one.
    """
    s3_zero.Motor(1)  # builds the twin once
    survey = partial(s3_zero.surveyed, count=searches, passes=passes)
    made = []
    for motor in in_processes("motors", survey, [1] * motors, seeds(seed, motors)):
        made.append(motor)
        if motor.warned or motor.different:
            console.print(f"{motor}")
    warned = [motor for motor in made if motor.warned]
    margins = [motor.survey.margin_nm for motor in made if motor.survey]
    gates = Counter(motor.survey.gate for motor in made if motor.survey)
    console.print(
        f"{len(made)} motors, {sum(len(motor.zeros) for motor in made)} searches; {len(warned)} "
        f"motors with a warning, of which {sum(motor.different > 0 for motor in warned)} found "
        f"different counts; margin from {min(margins, default=math.nan):.0f} nm on; gates: "
        + ", ".join(f"{gate} {number}" for gate, number in gates.items())
    )
    if len(warned) > max(1, len(made) * WARNED_PCT / 100):
        return math.nan
    return sum(motor.different for motor in made if not motor.warned)


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
        "counts of 1 um, the index a quarter of a count behind an edge with +-0.05 um of scatter",
        "0",
        Quick({"count": 20}, "20 searches"),
        1,
        "the paper +-2",
    ),
    "s3_zero_any_mark": Figure(
        s3_zero_any_mark,
        "searches",
        "of 200 linear motors with the mark anywhere between the edges of A and B, a quarter to "
        "four periods wide, and edges with a random part of all errors of a bad world, 20 "
        "searches each after `moire index survey`: searches that found another count without a "
        "warning of the survey, which may warn of 5 % of the motors",
        "0",
        Quick(
            {"motors": 1, "searches": 2, "passes": 2},
            "one motor, 2 searches after a survey of 2 passes",
        ),
        0,
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


def motor_of_part(part: int, seed: int) -> Counts:
    motor = s3_zero.surveyed(seed, SEARCHES_A_MOTOR)
    return {
        "searches": len(motor.zeros),
        "different": 0 if motor.warned else motor.different,
        "motors with a warning": int(motor.warned),
    }


CAMPAIGNS = {
    "any_mark_s3": Campaign(
        "zero searches of linear motors of S3 with the mark anywhere, after its survey; failed: "
        "another count than most of this motor, without a warning of the survey",
        motor_of_part,
        parts=5000,
        tried="searches",
        failed="different",
    ),
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

# SPDX-License-Identifier: Apache-2.0
"""The survey of an index, on a scale whose edges are drawn again in each pass: what it finds, what
it warns of, what it refuses, and what it leaves behind.
"""

import random

import pytest

from moire.client.index_survey import Edge, Survey, best_count, margin, shift_of_index
from moire.errors import MotionFailed, NotSurveyed, OutOfRange
from tb.bench import seed
from tb.fakes.index_axis import COUNT_NM, IndexAxis

SHIFTS = (1 / 6, -1 / 9, -1 / 18, 1 / 9)  # duty 20 degrees, phase 10 degrees, rounded


def survey(axis, passes=6):
    return Survey(axis, passes, None).run()


@pytest.mark.parametrize("method", ["s3", "33", "34"])
def test_any_index_has_a_gate_that_always_finds_the_same_count_or_a_warning(method):
    source, warned, several = random.Random(seed()), 0, 0
    for number in range(150):
        axis = IndexAxis(
            (source.uniform(0, 4), source.choice((1, 1.5, source.uniform(1, 16)))),
            shifts=SHIFTS,
            scatter=0.05,
            index_scatter=source.uniform(0, 0.1),
            hysteresis=0.3,
            seed=number,
            home_method=method,
        )
        several += len(axis.zeros(20)) > 1
        found = survey(axis)
        zeros = axis.zeros(40)
        if found.warnings:
            warned += 1
        else:
            assert len(zeros) == 1 and found.margin_nm >= found.least_margin_nm, (axis.indexes, found)
    assert warned <= 7 and several >= 10  # without a gate, many of them find several counts

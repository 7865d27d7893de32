# SPDX-License-Identifier: Apache-2.0
"""experiments.s0_metrology on a stage of the twin whose scale has a known error."""

import numpy as np
import pytest

from experiments import s0_metrology
from experiments.s0_metrology import RATE_HZ, STEPS, Metrology, targets
from experiments.s0_stage import Stage
from tb.bench import seed

SEED = seed()
SCALE_ERROR = 2e-4  # the scale reads more than the true distance, by this share
TARGETS_NM = (2e5, 6e5)
NOISE_NM = 15.0  # of an error at the end of a move


@pytest.fixture(scope="module")
def measured():
    print(f"SEED={SEED}")
    stage = Stage.power_up(SEED, ("X",), scale_linear=SCALE_ERROR)
    stage.home("X")
    return Metrology(stage, "X")


def test_a_test_by_iso_230_2_finds_the_error_of_the_scale(measured):
    measured.run_iso_230_2(TARGETS_NM, runs=2)
    test, expected = measured.test, SCALE_ERROR * (TARGETS_NM[1] - TARGETS_NM[0])
    means = (test.mean_up + test.mean_down) / 2
    assert np.shape(test.up) == np.shape(test.down) == (2, 2)
    assert means[1] - means[0] == pytest.approx(expected, abs=NOISE_NM), "the axis falls short"
    assert test.systematic >= test.mean_deviation == pytest.approx(expected, abs=NOISE_NM)
    assert test.reversal < NOISE_NM and test.accuracy > test.systematic
    assert "2 targets, 2 runs" in measured.words["ISO 230-2"]


def test_steps_end_settled_all_over_a_signal_period(measured):
    before = len(measured.settled_s)
    measured.step(1e5)
    new = measured.settled_s[before:]
    assert len(new) >= STEPS - 1 and all(0 <= time_s < 0.2 for time_s in new)
    (amplitudes,) = measured.harmonics_nm.values()
    assert len(amplitudes) == s0_metrology.ORDERS and 0 < amplitudes.max() < NOISE_NM


def test_the_axis_stands_still(measured):
    errors = measured.stand_still(0.1)
    assert len(errors) == pytest.approx(0.1 * RATE_HZ, rel=0.05)
    assert errors.std() < 5
    assert set(measured.pictures()) == {"standstill", "allan", "settling", "harmonics", "iso_230_2"}
    assert measured.window_nm == pytest.approx(20, abs=0.1)


def test_the_targets_are_spread_over_the_travel_and_differ_from_equal_distances():
    found = targets(0, 20e6, SEED)
    assert len(found) == 5 and found == targets(0, 20e6, SEED)
    assert all(1e6 <= target - 4e6 * number <= 3e6 for number, target in enumerate(found))
    assert len(set(np.diff(found))) > 1

# SPDX-License-Identifier: Apache-2.0
"""The fine stage on the table, driven by frames to its DAC, compared with calculations by hand."""

import math

import numpy
import pytest

from twin.machines.stage import Stage

DAMPED = dict(piezo_mode_damping=0.7)
STILL = dict(piezo_creep=0, **DAMPED)


def fine_stage(**values):
    stage = Stage(piezo_fitted=1, **values)
    stage.hold(rotor=True, table=True)
    return stage


def go(stage, code, seconds=0.05):
    stage.dac(code)
    stage.run(seconds)
    return stage.state.piezo_m


def test_the_full_loop_is_the_range_and_its_middle_is_as_wide_as_stated():
    stage = fine_stage(**STILL)
    go(stage, 65535)
    down, low = go(stage, 32768), go(stage, 0)
    up, high = go(stage, 32768), go(stage, 65535)
    assert high - low == pytest.approx(10e-6, rel=1e-4)
    assert down - up == pytest.approx(0.12 * 10e-6, rel=1e-3)
    assert go(stage, 32768) == pytest.approx(down, abs=1e-12) and go(stage, 0) == pytest.approx(
        low, abs=1e-12
    )  # the loop closes


def test_a_small_loop_is_narrow_and_hardly_moves_the_branch():
    """Within the smallest play (1/11 of the swing) there is no hysteresis."""
    stage = fine_stage(**STILL)
    go(stage, 50000)
    positions = [go(stage, 50000 - n) for n in (0, 2000, 4000, 2000, 0)]
    assert (
        positions[0] - positions[1] == pytest.approx(positions[1] - positions[2], rel=1e-6)
        and positions[1] < positions[0]
    )
    assert positions[3:] == pytest.approx(positions[1::-1], abs=1e-13)


def test_it_creeps_by_its_fraction_in_each_decade_of_time():
    stage = fine_stage(**DAMPED)
    go(stage, 65535, 0.0)
    stage.run(0.1)
    positions = []
    for seconds in (0.0, 0.9, 9.0):
        stage.run(seconds)
        positions.append(stage.state.piezo_m)
    first = positions[0]
    assert (positions[1] - positions[0]) / first == pytest.approx(0.015, rel=0.1)
    assert (positions[2] - positions[1]) / first == pytest.approx(0.015, rel=0.1)


def test_the_amplifier_slews():
    stage = fine_stage(**STILL)
    stage.trace(100_000)
    go(stage, 65535, 0.02)
    trace = stage.take_trace()
    full = trace["piezo_m"][-1]
    took = [
        trace["time_s"][numpy.argmax(trace["piezo_m"] > share * full)] for share in (0.25, 0.75)
    ]
    assert (
        0.4 * 10e-3 < took[1] - took[0] < 0.6 * 10e-3
    )  # 10 ms from the middle to the end, bent a little by the hysteresis


def test_its_mode_rings_with_its_frequency_and_damping():
    stage = fine_stage(piezo_creep=0, piezo_slew=1e6)
    stage.trace(100_000)
    go(stage, 36000, 0.03)
    trace = stage.take_trace()
    time = trace["time_s"]
    go(stage, 36000, 0.3)
    swing = trace["piezo_m"] - stage.state.piezo_m
    rises = [
        time[n] + swing[n] / (swing[n] - swing[n + 1]) * 1e-5
        for n in range(len(time) - 1)
        if swing[n] < 0 <= swing[n + 1]
    ]
    assert 8 / (rises[9] - rises[1]) == pytest.approx(500 * math.sqrt(1 - 0.02**2), rel=2e-3)
    peaks = [swing[(time >= a) & (time < b)].max() for a, b in zip(rises, rises[1:])]
    assert math.log(peaks[1] / peaks[6]) / 5 == pytest.approx(2 * math.pi * 0.02, rel=0.05)


def test_the_sensor_sees_table_and_piezo_together_and_the_table_feels_the_platform():
    stage = fine_stage(**STILL)
    there = stage.state.position_m
    moved = go(stage, 40000)
    assert stage.state.position_m - there == pytest.approx(moved, abs=1e-13) and moved > 0.5e-6
    free = Stage(piezo_fitted=1)
    free.run(0.1)
    before = free.state.position_m - free.state.piezo_m
    free.trace(100_000)
    go(free, 65535, 0.01)
    trace = free.take_trace()
    table = trace["position_m"] - trace["piezo_m"]
    assert 1e-11 < abs(table - before).max() < 20e-9


def test_the_platform_lags_a_table_that_accelerates_and_swings_when_it_stops():
    """By velocity / (2 pi 500 Hz), if the table stops at once."""
    stage = Stage(piezo_fitted=1, piezo_creep=0)
    stage.bridge(0.05, 0.3)
    stage.trace(1_000_000)
    stage.run(1e-5)
    velocity = stage.take_trace()["velocity_m_s"][-1]
    assert velocity > 1e-3
    stage.hold(rotor=True, table=True)
    stage.trace(100_000)
    stage.run(1e-3)
    swing = stage.take_trace()["piezo_m"].max()
    assert swing == pytest.approx(velocity / (2 * math.pi * 500), rel=0.1)


def test_a_stage_without_a_piezo_does_not_move_by_its_converter():
    stage = Stage()
    assert go(stage, 65535) == 0.0


def test_frames_are_16_bits_loaded_at_the_end_and_others_are_counted():
    stage = Stage(piezo_fitted=1)
    assert stage.state.dac_code == 32768
    for code in (0, 1, 0x8000, 0xA5C3, 65535):
        stage.dac(code)
        assert stage.state.dac_code == code
    assert stage.state.dac_bad_frames == 0
    stage.pins(dac_cs_n=0)
    stage.run(1e-5)
    assert stage.state.dac_code == 65535  # not before the frame ends
    stage.pins(dac_cs_n=1)
    stage.run(1e-5)
    stage.dac(0x12345, bits=17)
    assert stage.state.dac_code == 0x2345 and stage.state.dac_bad_frames == 2

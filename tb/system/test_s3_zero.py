# SPDX-License-Identifier: Apache-2.0
"""S3 as shipped: a linear motor behind its DAC, RTL and firmware, and every homing method."""

import random

import pytest

from experiments import s3_zero
from moire.errors import MotionFailed
from tb.bench import seed
from twin.parameters import tables as parameters

SEED = seed()
AT_MARK = {"switch_low": -1.5e-3, "switch_high": 1.5e-3}  # switches near enough for a short test
LOW, HIGH = -1500, 1500  # counts at which they open


@pytest.fixture(scope="module")
def motor():
    print(f"SEED={SEED}")
    return s3_zero.Motor(
        SEED,
        settings={"home_distance": "2.5mm", "travel_low": "-1mm", "travel_high": "1mm"},
        **AT_MARK,
    )


def home(motor, method, start_m=None):
    """Home by a method; returns the count of the scale that becomes zero."""
    if start_m is not None:
        motor.carry(start_m)
    motor.axis.disable()
    motor.axis.set_parameter("home_method", method)
    motor.search()
    status = motor.axis.status()
    assert status.homed and not status.faults and "illegal_edge" not in status.encoder_events
    return motor.twin.truth().scale_counts - status.counts


def test_searches_from_both_sides_of_the_mark_and_from_the_mark_find_the_same_count():
    source, motor = random.Random(SEED), s3_zero.Motor(SEED)
    made = [motor.search()]
    for side in (-1, 1) * 4 + (0,):
        motor.carry(side * source.uniform(0.02e-3, 1e-3))
        made.append(motor.search())
    made += [
        motor.search() for _ in range(3)
    ]  # each starts where the one before ended: on the index mark
    assert {search.zero_counts for search in made} == {0}
    assert {search.start_um > 0 for search in made} == {True, False}
    assert {len(search.directions.split(", ")) for search in made} >= {
        2,
        4,
    }  # the edge is met at once, and only on the other side
    assert all(abs(search.remaining_um) < 2 for search in made)


@pytest.mark.parametrize("start_m", [-0.8e-3, 0.8e-3])
def test_s3_method(motor, start_m):
    assert home(motor, -2, start_m) == 0


def test_method_33_and_34_take_the_edge_that_they_meet_first(motor):
    assert home(motor, 34, -0.3e-3) == 0  # the mark lies over the counts 0 and 1
    assert home(motor, 33, 0.3e-3) == 1


@pytest.mark.parametrize(("method", "start_m"), [(1, -0.5e-3), (2, 0.5e-3)])
def test_methods_1_and_2_take_the_first_mark_behind_the_switch(motor, method, start_m):
    assert home(motor, method, start_m) == (0 if method == 1 else 1)


@pytest.mark.parametrize(("method", "edge"), [(17, LOW), (18, HIGH)])
def test_methods_17_and_18_take_the_position_where_the_switch_opens(motor, method, edge):
    motor.axis.set_parameter("homing_latch_speed", "1mm/s")
    count = home(motor, method, edge * 0.7e-6)
    late = (
        motor.axis.get_parameter("homing_latch_speed").value * 1000 * 2 / 1000
    )  # um in the two ms until the firmware reads the switch
    assert abs(count - edge) <= 2 + late


@pytest.mark.parametrize("method", [35, 37])
def test_methods_35_and_37_set_the_zero_here(motor, method):
    motor.carry(0.4e-3)
    here = motor.twin.truth().scale_counts
    assert abs(home(motor, method) - here) <= 1  # the position at which the drive is enabled
    assert motor.axis.status().position_nm == pytest.approx(0, abs=2000)


def test_a_mark_on_an_edge_of_the_scale_is_surveyed_and_its_gate_finds_one_count():
    """In a bad world, both edges of the mark lie on those of count 1. If a pass sees the mark begin
    in the count before, the survey warns.
    """
    bad = parameters.world("bad", "linear_motor")
    motor = s3_zero.Motor(SEED, scale_index_position=8 / 9e6, scale_index_width=10 / 9e6, **bad)
    motor.axis.enable()
    found = motor.axis.survey_index(passes=2)
    assert found.gate == "a_high" and motor.axis.status().homed
    narrow = found.margin_nm < found.least_margin_nm
    assert found.warnings == (("index_on_edge",) if narrow else ())
    assert motor.zero_counts() == 1
    motor.carry(0.2e-3)
    assert motor.search().zero_counts == 1
    assert motor.axis.get_parameter("velocity").written() == "50mm/s"


def test_a_search_without_a_mark_in_reach_ends_with_its_cause_and_the_axis_under_control():
    motor = s3_zero.Motor(SEED, scale_index_position=5e-3)
    motor.axis.enable()
    with pytest.raises(MotionFailed) as caught:
        motor.axis.home()
    assert caught.value.cause == "no_index"
    status = motor.axis.status()
    assert status.state == "holding" and status.enabled and not status.homed and not status.faults
    before = motor.position_um
    motor.axis.dwell(0.1)
    assert abs(motor.position_um - before) < 2  # it is at rest


def test_an_index_mark_that_is_stuck_is_no_zero(motor):
    with motor.twin.fault("z_stuck", 0, True):
        motor.carry(-0.5e-3)
        motor.axis.set_parameter("home_method", 34)
        motor.axis.set_parameter("home_distance", "1mm")
        motor.axis.enable()
        with pytest.raises(MotionFailed) as caught:
            motor.axis.home()
    motor.axis.set_parameter("home_distance", "2.5mm")
    assert caught.value.cause == "no_index" and not motor.axis.status().homed

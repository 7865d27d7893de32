# SPDX-License-Identifier: Apache-2.0
"""S0's segment table in the node. A scale that is 20 ppm too long, bends every 1.5 mm and has a
random walk is measured against the true position at equal distances, the table is loaded, and what
is left of the error is what theory says.

Between borders h apart straight lines leave at most h^2 / 8 times the curvature of the error, and a
step of the walk there; the rectangle leaves half of what the error changes from border to border
besides.
"""

import math
import random

import pytest

from moire.client.bus import Bus
from moire.client.segments import Segments, SegmentTable
from moire.errors import Refused
from twin import WITH_SEGMENTS, Twin, TwinTransport

CYCLIC, PITCH, WALK = 150e-9, 1.5e-3, 10e-9
SCALE = dict(scale_linear=20e-6, scale_cyclic=CYCLIC, scale_pitch=PITCH, scale_walk=WALK)
IDEAL = dict(
    signal_offset_sin=0, signal_offset_cos=0, signal_gain_cos=1, signal_phase_error=0
)  # the calibration has its own tests
SEGMENTS, LENGTH_NM = 10, 200_000
NOISE_NM = 6  # noise of a reading, and of the two borders beside it
CURVED_NM = LENGTH_NM**2 / 8 * CYCLIC * 1e9 * (2 * math.pi / PITCH / 1e9) ** 2


class Stage:
    def __init__(self, twin):
        self.machine, self.axis = (
            twin.machine(),
            Bus(TwinTransport(twin), random_source=random.Random(1)).axis(1),
        )
        twin.run_until_ready()
        self.segments = Segments(self.axis)
        self.axis.enable()
        self.axis.home()
        self.zero_nm = 0.0
        self.zero_nm = self.true_nm() - self.axis.status().position_nm

    def true_nm(self):
        return self.machine.state.position_m * 1e9 - self.zero_nm

    def error_nm(self, target_nm=None):
        """Reported position minus the true one, at a target or here."""
        if target_nm is not None:
            self.axis.move(nm=target_nm)
        readings = [(self.axis.status().position_nm, self.true_nm()) for _ in range(4)]
        return sum(position - true for position, true in readings) / len(readings)


@pytest.fixture(scope="module")
def stage():
    with Twin(nodes=(1,), plant={**SCALE, **IDEAL}, node_parameters=WITH_SEGMENTS) as twin:
        yield Stage(twin)


@pytest.fixture(scope="module")
def table(stage):
    return SegmentTable(
        0, LENGTH_NM, tuple(stage.error_nm(n * LENGTH_NM) for n in range(SEGMENTS + 1))
    )


def targets(direction):
    """Targets between the borders, approached in one direction."""
    positions = [(n + share) * LENGTH_NM for n in (0, 4, 9) for share in (0.25, 0.6)]
    return positions if direction > 0 else positions[::-1]


def left_nm(stage, direction):
    stage.axis.move(nm=0 if direction > 0 else SEGMENTS * LENGTH_NM)
    return {target: stage.error_nm(target) for target in targets(direction)}


def test_the_scale_has_the_error_that_was_set(table):
    assert max(map(abs, table.errors)) > 100 and abs(table.errors[0]) < NOISE_NM


@pytest.mark.parametrize("direction", [1, -1])
def test_straight_lines_leave_the_theoretical_error_in_both_directions(stage, table, direction):
    assert stage.segments.load(table, "linear").in_force == "linear"
    for target, left in left_nm(stage, direction).items():
        assert abs(left) <= CURVED_NM + NOISE_NM, f"{left:.1f} nm at {target} nm"


@pytest.mark.parametrize("direction", [1, -1])
def test_the_rectangle_leaves_half_a_step_more_in_both_directions(stage, table, direction):
    assert stage.segments.load(table, "rectangle").in_force == "rectangle"
    for target, left in left_nm(stage, direction).items():
        low = table.errors[int(target // LENGTH_NM)]
        high = table.errors[int(target // LENGTH_NM) + 1]
        share = target / LENGTH_NM % 1 - 0.5
        assert abs(left - (high - low) * share) <= CURVED_NM + NOISE_NM, (
            f"{left:.1f} nm at {target} nm"
        )


def test_when_the_table_comes_into_force_the_stage_stays_and_its_position_changes_scale(
    stage, table
):
    stage.segments.load(table, "linear")
    stage.segments.use("off")
    error = stage.error_nm(3.5 * LENGTH_NM)
    assert abs(error) > 30
    for use, expected in (("linear", 0), ("off", error), ("rectangle", 0), ("off", error)):
        before = stage.true_nm()
        stage.segments.use(use)
        assert abs(stage.true_nm() - before) < NOISE_NM
        assert abs(stage.error_nm() - expected) < CURVED_NM + NOISE_NM + (use == "rectangle") * 5
        seen = [stage.axis.status() for _ in range(8)]  # with friction, single readings differ more
        assert abs(sum(s.target_nm - s.position_nm for s in seen) / len(seen)) < NOISE_NM
        assert {s.state for s in seen} == {"holding"}


def test_a_homing_begins_without_the_table_and_finds_the_same_zero(stage, table):
    stage.segments.load(table, "linear")
    stage.error_nm(0.5 * LENGTH_NM)
    stage.axis.home()
    assert stage.segments.use("linear").in_force == "linear"
    assert (
        abs(stage.error_nm()) < NOISE_NM
        and abs(stage.error_nm(2.5 * LENGTH_NM)) < CURVED_NM + NOISE_NM
    )


def test_a_table_in_use_is_refused_a_change_and_a_moving_axis_too(stage, table):
    stage.segments.load(table, "linear")
    seconds = stage.axis.begin_move(mm=1.5)
    assert seconds > 0.1
    with pytest.raises(Refused, match="moving"):
        stage.segments.use("off")
    stage.axis.wait()
    with pytest.raises(Refused, match="in use"):
        stage.axis.write_parameter("segment_count", 3)
    assert stage.segments.status().in_force == "linear"

# SPDX-License-Identifier: Apache-2.0
"""moire.client: motions of one axis that succeed, fail, or are interrupted."""

from fractions import Fraction

import pytest

from moire.client.bus import Bus
from moire.errors import BusError, MotionFailed, NoAnswer, OutOfRange, Refused, UnitError
from moire.made.bus_tables import CAUSES
from tb.fakes.bus_node import START, SWITCH
from tb.host.stage import homed_stage, stage
from twin.compiled.axis import Axis
from twin.compiled.tables import FAULT, PERIOD


def test_home_and_move_reach_their_targets():
    wire, node, axis = stage()
    axis.enable()
    seen = []
    status = axis.home(progress=seen.append)
    assert (
        status.homed
        and status.position_nm == 0
        and {"homing", "holding"} == {each.state for each in seen}
    )
    assert axis.move(mm=1.5).position_nm == 1_500_000
    assert axis.move("-200um", by=True).position_nm == 1_300_000
    assert axis.move(nm=50).position_nm == pytest.approx(50, abs=0.01)
    with pytest.raises(OutOfRange, match="a move needs one target"):
        axis.move("1nm", mm=1)
    with pytest.raises(UnitError):
        axis.move("fast")


@pytest.mark.parametrize("operation", ["move", "begin_move", "prepare"])
def test_a_target_without_its_unit_is_refused_and_the_axis_does_not_move(operation):
    wire, node, axis = homed_stage()
    for number in (1.5, 0, Fraction(3, 2)):
        with pytest.raises(UnitError, match="has no unit: write mm="):
            getattr(axis, operation)(number)
    assert operation not in node.executed and "move" not in node.executed


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf"), "far", None])
@pytest.mark.parametrize("unit", ["nm", "um", "mm"])
def test_a_target_that_is_no_finite_number_is_out_of_range(unit, number):
    wire, node, axis = homed_stage()
    with pytest.raises(OutOfRange, match="is no length: give a finite number|needs one target"):
        axis.move(**{unit: number})
    assert "move" not in node.executed


@pytest.mark.parametrize(
    "target", [{"um": 1500}, {"mm": 1.5}, {"nm": 1.5e6}, {"mm": Fraction(3, 2)}]
)
def test_a_target_may_have_any_of_three_units(target):
    wire, node, axis = homed_stage()
    assert axis.move(**target).position_nm == 1_500_000


def test_the_end_of_a_with_block_switches_the_drive_off():
    wire, node, axis = stage()
    with axis as same:
        assert same is axis
        axis.enable()
        axis.home()
        assert node.axes[0].enabled
    assert not node.axes[0].enabled


def test_a_with_block_leaves_a_drive_on_that_was_on_before_also_when_nested():
    wire, node, axis = homed_stage()
    with axis:
        axis.move(mm=1)
        with axis:
            axis.move(mm=2)
    assert node.axes[0].enabled and axis.status().position_nm == 2_000_000


@pytest.mark.parametrize("was_on", [False, True])
def test_an_exception_in_a_with_block_stops_the_axis_before_the_drive_is_off(was_on):
    wire, node, axis = homed_stage()
    if not was_on:
        axis.disable()
    with pytest.raises(ZeroDivisionError):
        with axis:
            axis.enable()
            axis.begin_move(mm=10)
            raise ZeroDivisionError
    assert node.ended() == "stopped" and node.axes[0].enabled == was_on
    assert node.executed.count("stop") == 1
    last = [name for name in node.executed if name in ("stop", "enable")][-1]
    assert last == ("stop" if was_on else "enable")


def test_the_error_in_a_with_block_is_raised_and_not_that_of_its_end():
    wire, node, axis = stage()
    with pytest.raises(ZeroDivisionError):
        with axis:
            wire.to_nodes = lambda word: []
            raise ZeroDivisionError
    wire, node, axis = stage()
    with pytest.raises(NoAnswer):
        with axis:
            wire.to_nodes = lambda word: []


def test_a_motion_that_a_fault_ends_names_the_first_fault():
    wire, node, axis = homed_stage()
    wire.at.append((wire.now() + 0.2, lambda: setattr(node.axes[0], "causes", FAULT["limit_low"])))
    with pytest.raises(
        MotionFailed,
        match=r"axis 0 of node 1: a fault ended the motion: limit switch at the low end "
        r"\(at [0-9.]+um\)",
    ) as caught:
        axis.move(mm=10)
    assert caught.value.cause == "ended_by_fault"


def without_switch(node):
    node.axes[0].low_at = None


def switch_that_stays(node):
    node.axes[0].stuck_low = True


def shaft_that_is_blocked(node):
    node.axes[0].seized = True


@pytest.mark.parametrize(
    "situation, motion, cause",
    [
        (without_switch, "home", "no_switch"),
        (switch_that_stays, "home", "switch_stuck"),
        (shaft_that_is_blocked, "move", "not_settled"),
        (shaft_that_is_blocked, "move", "ended_by_fault"),
    ],
)
def test_a_motion_that_fails_reports_the_cause(situation, motion, cause):
    wire, node, axis = homed_stage()
    axis.load_parameters({"home_distance": "40um", "travel_low": "-1mm", "travel_high": "1mm"})
    situation(node)
    length = {"not_settled": "40um", "ended_by_fault": "60um"}  # 50 um are following_limit
    with pytest.raises(MotionFailed, match=dict(CAUSES.values())[cause]) as caught:
        axis.home() if motion == "home" else axis.move(length[cause])
    assert caught.value.cause == cause


def test_stop_from_the_progress_call_ends_the_motion_as_stopped():
    wire, node, axis = homed_stage()
    with pytest.raises(MotionFailed, match="stopped by the host"):
        axis.move(mm=10, progress=lambda status: axis.stop() if status.position_nm > 1e6 else None)
    assert not axis.status().in_motion


@pytest.mark.parametrize("what", [KeyboardInterrupt, ZeroDivisionError])
@pytest.mark.parametrize("motion", ["home", "move"])
def test_whatever_interrupts_the_wait_brings_the_axis_to_rest_first(what, motion):
    wire, node, axis = homed_stage()

    def interrupt(status):
        if status.state in ("homing", "moving"):
            raise what

    with pytest.raises(what):
        axis.home(progress=interrupt) if motion == "home" else axis.move(mm=10, progress=interrupt)
    assert node.executed.count("stop") == 1
    assert node.state() == "holding" and node.ended() == "stopped" and node.axes[0].enabled


def test_ctrl_c_in_the_middle_of_an_exchange_stops_the_axis_too():
    for position in range(40):
        wire, node, axis = homed_stage()
        seen = []

        def interrupt(word, position=position, seen=seen):
            seen.append(word)
            if len(seen) == position + 1:
                raise KeyboardInterrupt
            return [word]

        wire.to_nodes = interrupt
        with pytest.raises(KeyboardInterrupt):
            axis.move(mm=10)
        assert node.state() == "holding", position
        assert axis.move(mm=1).position_nm == 1_000_000  # and the bus is in order again


def test_an_axis_that_cannot_be_stopped_is_reported():
    wire, node, axis = homed_stage()

    def cut_and_interrupt(status):
        wire.to_nodes = lambda word: []
        raise KeyboardInterrupt

    with pytest.raises(
        BusError,
        match="axis 0 of node 1 could not be stopped by the host, its watchdog has to: nobody",
    ):
        axis.move(mm=10, progress=cut_and_interrupt)


def test_waiting_sends_requests_often_enough_for_the_watchdog():
    wire, node, axis = homed_stage()
    times = []
    node.port.on_request = lambda name, fields: times.append(wire.now())
    began = wire.now()
    axis.dwell(1.0)
    assert 1.0 <= wire.now() - began < 1.2
    assert max(b - a for a, b in zip(times, times[1:])) < 0.1
    wire.wait(0.49)
    assert axis.status().enabled
    wire.wait(0.52)
    assert axis.status().first_fault == ("bus_watchdog",)


def test_a_prepared_move_beyond_the_travel_reports_its_end():
    _, _, axis = homed_stage()
    with pytest.raises(Refused, match="target 200mm, allowed -800um to 119.6mm"):
        axis.prepare("200mm")
    with pytest.raises(OutOfRange, match="a prepare needs one target"):
        axis.prepare()


def test_ctrl_c_while_waiting_for_a_motion_stops_it():
    wire, node, axis = homed_stage()
    axis.begin_move("50mm")

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        axis.motion_end(interrupt)
    assert node.ended() == "stopped"


def test_pause_halts_and_resume_continues_at_the_earlier_override():
    wire, node, axis = homed_stage()
    assert axis.override() == 1 and axis.override("50%") == Fraction(1, 2)
    assert axis.begin_move("4.8mm") == pytest.approx(1.058, abs=0.01)
    axis.dwell(0.5)
    axis.pause()
    axis.pause()  # a second pause changes nothing
    assert axis.override() == 0 and node.parameter("feed_override") == 0
    halted = axis.dwell(0.1).position_nm
    assert axis.dwell(2).position_nm == halted and axis.status().in_motion and 0 < halted < 4.8e6
    assert axis.resume() == Fraction(1, 2)
    assert node.parameter("feed_override") == 1 << 15
    assert axis.motion_end().position_nm == pytest.approx(4.8e6, abs=1)


def test_resume_of_what_another_program_paused_is_full_speed():
    wire, _, axis = homed_stage()
    axis.pause()
    assert Bus(wire).axis(1).resume() == 1


@pytest.mark.parametrize("share", ["120%", "-1%", 1.5, "fast", "50 mm"])
def test_an_override_outside_0_to_1_is_refused(share):
    wire, node, axis = homed_stage()
    with pytest.raises(UnitError):
        axis.override(share)
    assert axis.override() == 1


def test_home_stores_the_requested_method():
    axes = [Axis(START, SWITCH, index=[SWITCH + 8 * PERIOD])]
    wire, node, axis = stage(axes=axes)
    axis.enable()
    for method, counts in ((35, 35), ("17", 17), ("s3", -2), ("s0", -1)):
        assert axis.home(method=method).homed
        assert node.parameter("home_method") == counts
    with pytest.raises(OutOfRange, match="home_method allows -2 to 37, not 99"):
        axis.home(method=99)


def test_the_rate_of_the_backlash_is_known_before_the_backlash(monkeypatch):
    """Without a rate the motor would take it up at once."""
    _, _, axis = stage()
    written = []
    monkeypatch.setattr(axis.node, "write_named", lambda name, *_, **fields: written.append(name))
    axis.set_backlash("5um", "1mm/s", "0.2um")
    assert written == ["feedback.backlash_rate", "feedback.backlash"]


def test_a_servo_with_its_sensor_on_the_table_needs_no_backlash(monkeypatch):
    _, _, axis = stage(absent=("stepper",))
    written = []
    monkeypatch.setattr(axis.node, "write_named", lambda name, *_, **fields: written.append(fields))
    with pytest.raises(OutOfRange, match="axis 0 of node 1 has no stepper: with its sensor"):
        axis.set_backlash("5um", "1mm/s", "0.2um")
    assert not written
    axis.set_backlash("5um", "1mm/s", "0.2um", motor_side=True)
    axis.set_backlash(0, "1mm/s", 0)
    assert [fields.get("motor_side") for fields in written] == [1, None, 0, None]

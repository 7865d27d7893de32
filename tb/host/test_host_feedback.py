# SPDX-License-Identifier: Apache-2.0
"""Calibration, correction, signal faults, capture and compare, through the client and through the
command line.
"""

import io
import json
import re

import pytest

from moire.cli import command_line
from moire.client.bus import Bus
from moire.errors import (
    MotionFailed,
    NoAnswer,
    NotCalibrated,
    OutOfRange,
    Refused,
    UnknownName,
)
from moire.made.bus_tables import PARAMETERS
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.firmware.test_firmware_feedback import Signal
from tb.host.call import Call, sentence
from twin.compiled.tables import DEFINES, FAULT

VELOCITY = PARAMETERS["velocity"].id
STROBES, SOURCES = DEFINES["FEEDBACK_STROBES"], DEFINES["FEEDBACK_CAPTURE_SOURCES"]
VALUES = dict(
    sin_offset=-300,
    cos_offset=12,
    gain=66000,
    quadrature_error=-5,
    cosine=list(range(10)),
    sine=[-n for n in range(10)],
)


def node_with_signal():
    """A node whose bursts show the signal of a scale in motion, which the calibration can learn."""
    node = BusNode()
    node.feedback_channels[0].burst = Signal()
    return node


def stage(homed=True):
    node = node_with_signal()
    axis = Bus(Rs485Bus(node)).axis()
    if homed:
        axis.enable()
        axis.home()
    return node, axis


def calibration(node):
    return node.ask("calibration", axis=0, action=0)


def speeds(node):
    """The velocities that were set, one after the other."""
    return [
        fields["value"]
        for fields in node.written("set_parameter")
        if fields["parameter"] == VELOCITY
    ]


# ---- calibration


def test_calibration_moves_at_several_speeds_and_ends_frozen_where_it_began():
    node, axis = stage()
    start, seen = node.axes[0].position, []
    reported = axis.calibrate(seen.append)
    assert (reported.settled, reported.frozen, reported.reason, reported.words) == (
        True,
        True,
        "frozen",
        "frozen",
    )
    state = calibration(node)
    assert reported.accepted == state["accepted"] >= 2 and state["frozen"] == 1
    assert reported.scatter_nm == pytest.approx(state["scatter"] / 2**20 * 800)
    assert node.axes[0].position == start and node.executed.count("move") == len(seen)
    # 1250 periods of 800 nm in half a second, as long as the calibration needs
    strokes = [2500, 2500, 1500, 1500, 2000, 2000]
    assert len(seen) % 2 == 0 and speeds(node) == [
        *strokes[: len(seen)],
        PARAMETERS["velocity"].default,
    ]
    assert axis.correction()["sin_offset"] == pytest.approx(1000, abs=8)  # as the signal has it


def test_calibrate_homes_calibrates_and_saves(tmp_path):
    node, file = node_with_signal(), tmp_path / "stage.json"
    call = Call(["commission", str(file), "--json"], node)
    assert call.code == 0, call.err
    assert (
        call.results[0]["command"] == "commission"
        and call.results[0]["settled"]
        and call.results[0]["frozen"]
    )
    saved = json.loads(file.read_text())["correction"]
    assert node.homed() and saved["sin_offset"] == pytest.approx(1000, abs=8)
    assert saved["sin_offset"] == node.ask("get_correction", axis=0)["sin_offset"]
    before = node.executed.count("home")
    assert Call(["commission", str(file)], node).code == 0 and node.executed.count("home") == before


def test_a_calibration_that_takes_too_long_fails_with_its_reason():
    node, axis = stage()
    node.feedback_channels[0].burst = None  # a burst is never complete
    node.set(velocity=900)
    with pytest.raises(
        NotCalibrated,
        match="found no correction within 3s: calibrating \\(0 accepted, 0 refused\\)",
    ) as caught:
        axis.calibrate(timeout="3s")
    assert (
        caught.value.cause == "calibrating"
        and calibration(node)["frozen"] == 1
        and node.parameter("velocity") == 900
    )
    assert max(speeds(node)) == 900


def test_the_reason_of_a_failed_calibration_is_that_of_the_motion_and_not_of_its_end():
    node, axis = stage()
    node.feedback_channels[0].spoiled = True
    with pytest.raises(
        NotCalibrated, match="the amplitude is outside its window \\(0 accepted, [1-9]"
    ) as caught:
        axis.calibrate(timeout="1s")
    assert caught.value.cause == "amplitude"


def test_calibration_needs_a_homed_axis_and_room_and_a_distance():
    node, axis = stage(homed=False)
    axis.enable()
    axis.set_correction(VALUES)
    with pytest.raises(Refused, match="home it first"):
        axis.calibrate()
    assert axis.correction() == VALUES
    assert node.parameter("velocity") == PARAMETERS["velocity"].default
    node, axis = stage()
    for wrong in (dict(distance="0mm"), dict(distance="-1mm"), dict(timeout=0)):
        with pytest.raises(OutOfRange, match="above zero"):
            axis.calibrate(**wrong)
    with pytest.raises(OutOfRange, match="no room for 200mm: the travel is -800um to 119.6mm"):
        axis.calibrate(distance="200mm")
    axis.move(mm=119.5)
    axis.calibrate(distance="0.5mm")  # to the side with room
    assert node.axes[0].position == axis.to_counts("119.5mm") and "calibration" in node.executed


@pytest.fixture
def corrected():
    """A node with a correction in force, homed and with its drive on, its axis, and the same axis
    as another host on the same bus has it.
    """
    node, axis = stage()
    axis.set_correction(VALUES)
    axis.transport.wait(0.02)  # until the table is written
    return node, axis, Bus(axis.transport).axis()


def test_a_calibration_that_cannot_move_the_axis_changes_nothing(corrected):
    node, axis, other = corrected
    velocity = node.parameter("velocity")
    other.begin_move(mm=50)
    with pytest.raises(Refused, match="the axis is moving"):
        axis.calibrate()
    assert node.state() == "moving" and "stop" not in node.executed
    other.stop_and_wait()
    other.disable()
    with pytest.raises(Refused, match="the drive is off"):
        axis.calibrate()
    assert axis.correction() == VALUES and node.parameter("velocity") == velocity
    assert {fields["action"] for fields in node.written("calibration")} == {0}


def test_a_motion_that_another_client_begins_between_two_strokes_goes_on(corrected):
    node, axis, other = corrected
    with pytest.raises(Refused, match="the axis is moving"):
        axis.calibrate(lambda state: other.begin_move(mm=50))
    assert node.state() == "moving" and "stop" not in node.executed
    assert calibration(node)["frozen"] == 1


def test_a_stroke_is_stopped_when_the_bus_has_failed(corrected):
    node, axis, other = corrected
    velocity, bus = node.parameter("velocity"), axis.transport
    axis.set_parameter("watchdog_time", "0s")
    silent_s = axis.node.bus.tries * axis.node.bus.answer_s
    begins, whole = bus.now() + 0.2, bus.to_nodes
    bus.at += [
        (begins, lambda: setattr(bus, "to_nodes", lambda word: [])),
        (begins + 1.2 * silent_s, lambda: setattr(bus, "to_nodes", whole)),
    ]
    with pytest.raises(NoAnswer):
        axis.calibrate(distance="50mm")
    assert node.ended() == "stopped" and node.parameter("velocity") == velocity
    assert calibration(node)["frozen"] == 1


def test_a_fault_during_calibration_is_the_error_that_is_raised():
    node, axis = stage()
    axis.transport.at.append(
        (axis.transport.now() + 0.3, lambda: setattr(node.axes[0], "causes", FAULT["drive"]))
    )
    with pytest.raises(MotionFailed, match="the drive reports a fault"):
        axis.calibrate()
    assert calibration(node)["frozen"] == 1


def test_calibration_actions_are_checked():
    _, axis = stage()
    assert (
        axis.calibration("calibrate").reason == "calibrating" and axis.calibration().frozen is False
    )
    assert axis.calibration("freeze").reason == "frozen"
    with pytest.raises(
        OutOfRange, match="has no action 'rest': allowed are read, calibrate, freeze, clear"
    ):
        axis.calibration("rest")


# ---- correction


def test_a_correction_is_read_and_written_back_as_a_whole():
    node, axis = stage()
    axis.set_correction(VALUES)
    assert axis.correction() == VALUES
    channel = node.feedback_channels[0]
    axis.transport.wait(0.02)  # until the table is written
    assert channel.correction == {name: VALUES[name] for name in channel.correction}


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {**VALUES, "gain": 1.5},
        {**VALUES, "gain": True},
        {**VALUES, "sine": [0] * 9},
        {**VALUES, "sine": 3},
        {**VALUES, "cosine": ["1"] * 10},
    ],
)
def test_an_incomplete_correction_is_refused_before_anything_is_sent(wrong):
    node, axis = stage()
    with pytest.raises(OutOfRange, match="this is no correction"):
        axis.set_correction(wrong)
    assert "set_harmonic" not in node.executed


def test_a_correction_out_of_range_changes_nothing():
    _, axis = stage()
    before = axis.correction()
    for wrong in ({**VALUES, "gain": 0}, {**VALUES, "cosine": [1 << 23] * 10}):
        with pytest.raises(Refused, match="outside"):
            axis.set_correction(wrong)
    with pytest.raises(OutOfRange, match="does not fit on the bus"):
        axis.set_correction({**VALUES, "sin_offset": 1 << 15})
    assert axis.correction() == before


# ---- signal, capture, compare


def test_signal_faults_are_reported_by_name_and_in_words():
    node, axis = stage()
    node.set_feedback(SIGNAL_FAULTS=1 << 9 | 1 << 14, FIRST_SIGNAL_FAULTS=1 << 9)
    signal = axis.signal()
    assert signal.faults == ("channel_missing", "lost_count") and signal.first == (
        "channel_missing",
    )
    assert signal.first_words == "the comparators change, a channel never changes its sign"


def test_captures_are_read_oldest_first_and_losses_are_reported():
    node, axis = stage()
    channel = node.feedback_channels[0]
    channel.captures += [(0b0001 | 40 << 7, 1000, 65536), (0b1100, 2000, -65536)]
    node.set_feedback(CAPTURE_STATE=64)  # overrun
    captures, lost = axis.captures()
    assert lost and [(c.sources, c.position_nm, c.time_clk) for c in captures] == [
        (("index",), 800, 1000),
        (("software", "probe_0_rising"), -800, 2000),
    ]
    assert captures[0].age_s == 1e-5 and not channel.captures
    assert axis.captures() == ([], False)


def registers_written(node):
    """(register of the feedback channel, value) of each request to write."""
    return [
        (fields["address"] - DEFINES["FEEDBACK_BASE"], fields["value"])
        for fields in node.written("write_register")
    ]


def test_capture_sources_are_selected_by_name():
    node, axis = stage()
    axis.capture_from("probe_1_falling", "index")
    assert registers_written(node) == [(SOURCES, 0b1000001), (STROBES, 1)]
    axis.capture_from("software")
    axis.capture_now()
    axis.transport.wait(0.001)
    axis.node.bus.sync()  # the broadcast captures too
    [(first, second), lost] = axis.captures()
    assert first.sources == second.sources == ("software",) and not lost
    assert first.position_nm == axis.status().position_nm and second.time_clk > first.time_clk
    axis.capture_from()
    axis.capture_now()
    assert axis.captures() == ([], False)
    with pytest.raises(UnknownName, match="no capture source 'probe': known are index, tick"):
        axis.capture_from("probe")


def test_compare_is_set_up_completely_and_armed_last():
    node, axis = stage()
    axis.compare_from("0.8mm", "-80um", 5, "2us", "1ms")
    assert registers_written(node)[0] == (STROBES, 1 << 9)
    assert registers_written(node)[-1] == (STROBES, 1 << 8)
    assert (
        node.feedback("COMPARE_START_LOW") | node.feedback("COMPARE_START_HIGH") << 32
        == 1000 * 65536
    )
    assert (
        node.feedback("COMPARE_STEP_LOW") | node.feedback("COMPARE_STEP_HIGH") << 32
        == (1 << 48) - 100 * 65536
    )
    assert [node.feedback(f"COMPARE_{name}") for name in ("COUNT", "PULSE", "GAP")] == [5, 8, 4000]
    assert (DEFINES["FEEDBACK_COMPARE_STATE"], 2) in registers_written(node)  # clears `late`
    node.set_feedback(COMPARE_STATE=3, COMPARE_PASSED=4)
    assert axis.compare() == type(axis.compare())(armed=True, passed=4, late=True)
    for wrong in (
        dict(step=0),
        dict(step="9999m"),
        dict(start="9999999m"),
        dict(pulse="10s"),
        dict(gap="1ns"),
        dict(count=-1),
    ):
        with pytest.raises(OutOfRange):
            axis.compare_from(**{"start": 0, "step": "1um", "count": 0, **wrong})


def test_only_32_bit_words_are_written_to_registers():
    _, axis = stage()
    for wrong in ((2, 0), (-4, 0), (65536, 0), (0xC60, -1), (0xC60, 1 << 32)):
        with pytest.raises(OutOfRange, match="32-bit words"):
            axis.node.write_register(*wrong)
    with pytest.raises(Refused, match=r"no register at this address \(address 0x0400\)"):
        axis.node.write_register(0x400, 0)


# ---- the command line


def test_calibrate_save_clear_load_on_the_command_line(tmp_path):
    node, file = node_with_signal(), str(tmp_path / "correction.json")
    call = Call("home -- calibrate --distance 80um --timeout 1min -- correction show", node)
    assert (
        call.code == 0 and "calibrated in" in call.out and "known to 0.000 nm, frozen" in call.out
    )
    assert "harmonics of the phase, nm: 1: 0.000" in call.out and not node.axes[0].enabled
    assert Call(["correction", "save", file], node).out == f"correction saved in {file}\n"
    other = BusNode()
    assert Call(["correction", "load", file], other).code == 0 and other.ask(
        "get_correction", axis=0
    ) == node.ask("get_correction", axis=0)
    for action, frozen in (("calibrate", 0), ("freeze", 1), ("clear", 1)):
        assert (
            Call(f"correction {action}", node).code == 0 and calibration(node)["frozen"] == frozen
        )
    assert "not settled" in Call("correction show", node).out


def test_a_calibration_that_fails_is_exit_code_1_with_its_cause():
    node = BusNode()
    reported = Call("home -- calibrate --timeout 2s --json", node).results[-1]
    assert (reported["error"], reported["cause"], reported["exit_code"]) == (
        "NotCalibrated",
        "calibrating",
        1,
    )


def test_the_progress_of_the_calibration_is_shown(monkeypatch):
    class Screen(io.StringIO):
        def isatty(self):
            return True

    err = Screen()
    assert (
        command_line.main(
            ["home", "--", "calibrate"], lambda _: Rs485Bus(node_with_signal()), io.StringIO(), err
        )
        == 0
    )
    assert "calibrating; not settled (1 accepted, 0 refused)" in err.getvalue()


def test_signal_capture_and_compare_on_the_command_line():
    node = BusNode()
    assert "nothing is wrong with the signal\n  first since reset: none" in Call("signal", node).out
    node.set_feedback(SIGNAL_FAULTS=1, FIRST_SIGNAL_FAULTS=3)
    assert (
        "signal too small\n  first since reset: signal too small, signal too large"
        in Call("signal", node).out
    )
    node.feedback_channels[0].captures.append((0b0010, 1000, 65536))
    call = Call("capture from tick software -- capture now -- capture read -- capture from", node)
    assert (
        call.code == 0
        and "captures from tick, software" in call.out
        and "captures from nothing" in call.out
    )
    assert "2 captures\n  0.000800 mm at cycle 1000, its sample 0.00 us before: tick" in call.out
    assert re.search(r"\n  0.001507 mm at cycle \d+, its sample 0.00 us before: software", call.out)
    node.set_feedback(COMPARE_STATE=1, COMPARE_PASSED=2)
    assert "under way, 2 points passed" in Call("compare show", node).out
    call = Call("compare from -1mm 10um --count 3 -- compare off", node)
    assert call.code == 0 and "pulses from -1mm every 10um, count: 3" in call.out


@pytest.mark.parametrize(
    "text",
    [
        "signal",
        "correction show",
        "correction freeze",
        "capture from",
        "capture from tick",
        "capture now",
        "capture read",
        "compare from 1mm 1um",
        "compare show",
        "compare off",
        "home -- calibrate",
    ],
)
def test_each_command_prints_one_json_object_in_a_line(text):
    node = node_with_signal()
    node.feedback_channels[0].captures.append((1, 2, 3))
    call = Call(text + " --json", node)
    assert call.code == 0 and call.err == ""
    assert [reported["command"] for reported in call.results] == [
        part.split()[0] for part in text.split(" -- ")
    ]


@pytest.mark.parametrize(
    "text, message",
    [
        ("calibrate --distance 1", "has no unit"),
        ("calibrate --distance 0mm", "not above zero"),
        ("calibrate --timeout -1s", "not above zero"),
        ("correction", "an ACTION is missing"),
        ("correction load /no/such/file", "cannot be read"),
        ("capture from probe", "there is no source 'probe'"),
        ("compare from 1mm", "STEP is missing"),
        ("compare from 1mm 0mm", "the step not zero"),
        ("compare from 1mm 1um --count 0", "no whole number above 0"),
        ("compare from 1mm 1um --pulse 9s", "pulse and gap allow"),
    ],
)
def test_wrong_usage_is_one_sentence(text, message):
    node = BusNode()
    assert message in sentence(Call(text, node), 2)
    assert set(node.executed) <= {"identify", "get_parameter"}


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"correction": 3}', "{", '{"correction": {"gain": 65536}}']
)
def test_a_file_that_holds_no_correction_is_refused(tmp_path, text):
    node, file = BusNode(), tmp_path / "wrong.json"
    file.write_text(text)
    sentence(Call(["correction", "load", str(file)], node), 2)
    assert "set_correction" not in node.executed

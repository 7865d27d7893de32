# SPDX-License-Identifier: Apache-2.0
"""Calibration, correction, signal faults, capture and compare, through the client and through the
command line.
"""

import io
import json

import pytest

from moire.cli import command_line
from moire.client.bus import Bus
from moire.errors import MotionFailed, NotCalibrated, OutOfRange, Refused, UnknownName
from moire.made.bus_tables import PARAMETERS
from tb.fakes.fake_node import FakeBus, FakeNode
from tb.host.test_host_command_line import Call, sentence

VELOCITY = PARAMETERS["velocity"].id
VALUES = dict(
    sin_offset=-300,
    cos_offset=12,
    gain=66000,
    quadrature_error=-5,
    cosine=list(range(10)),
    sine=[-n for n in range(10)],
)


def stage(homed=True):
    node = FakeNode()
    axis = Bus(FakeBus(node)).axis()
    if homed:
        axis.enable()
        axis.home()
    return node, node.axes[0], axis


# ---- calibration


def test_calibration_moves_at_several_speeds_and_ends_frozen_where_it_began():
    _, inside, axis = stage()
    inside.moves_to_calibrate = 7
    start, seen = inside.position, []
    reported = axis.calibrate(seen.append)
    assert (reported.settled, reported.frozen, reported.reason, reported.words) == (
        True,
        True,
        "frozen",
        "frozen",
    )
    assert (
        reported.scatter_nm == pytest.approx(26 / 2**20 * 800)
        and len(seen) == 8
        and inside.position == start
    )
    assert inside.speeds == [
        2500,
        2500,
        1500,
        1500,
        2000,
        2000,
        2500,
        2500,
    ]  # 1250 periods of 800 nm in half a second
    assert inside.parameters[VELOCITY] == PARAMETERS["velocity"].default


def test_calibrate_homes_calibrates_and_saves(tmp_path):
    node, file = FakeNode(), tmp_path / "stage.json"
    node.axes[0].correction["gain"] = 65000
    call = Call(["commission", str(file), "--json"], node)
    assert call.code == 0, call.err
    assert (
        call.results[0]["command"] == "commission"
        and call.results[0]["settled"]
        and call.results[0]["frozen"]
    )
    assert node.axes[0].homed and json.loads(file.read_text())["correction"]["gain"] == 65000
    before = node.executed.count("home")
    node.axes[0].moves_to_calibrate = 4
    assert Call(["commission", str(file)], node).code == 0 and node.executed.count("home") == before


def test_a_calibration_that_takes_too_long_fails_with_its_reason():
    _, inside, axis = stage()
    inside.moves_to_calibrate = None
    inside.parameters[VELOCITY] = 900
    with pytest.raises(
        NotCalibrated,
        match="learned no correction within 3s: calibrating \\(0 accepted, 0 refused\\)",
    ) as caught:
        axis.calibrate(timeout="3s")
    assert (
        caught.value.cause == "calibrating"
        and inside.calibration_state["frozen"] == 1
        and inside.parameters[VELOCITY] == 900
    )
    assert max(inside.speeds) == 900


def test_calibration_needs_a_homed_axis_and_room_and_a_distance():
    _, _, axis = stage(homed=False)
    axis.enable()
    with pytest.raises(Refused, match="home it first"):
        axis.calibrate()
    node, inside, axis = stage()
    for wrong in (dict(distance="0mm"), dict(distance="-1mm"), dict(timeout=0)):
        with pytest.raises(OutOfRange, match="above zero"):
            axis.calibrate(**wrong)
    with pytest.raises(OutOfRange, match="no room for 200mm: the travel is -800um to 119.6mm"):
        axis.calibrate(distance="200mm")
    axis.move(mm=119.5)
    axis.calibrate(distance="0.5mm")  # to the side with room
    assert inside.position == axis.to_counts("119.5mm") and "calibration" in node.executed


def test_a_fault_during_calibration_is_the_error_that_is_raised():
    node, inside, axis = stage()
    inside.moves_to_calibrate = None
    inside.end_cause = "not_settled"
    with pytest.raises(MotionFailed, match="the target was not reached"):
        axis.calibrate()
    assert inside.calibration_state["frozen"] == 1


def test_calibration_actions_are_checked():
    _, inside, axis = stage()
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
    _, inside, axis = stage()
    axis.set_correction(VALUES)
    assert axis.correction() == VALUES and inside.harmonics[3] == (2, -2)


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
    node, _, axis = stage()
    with pytest.raises(OutOfRange, match="this is no correction"):
        axis.set_correction(wrong)
    assert "set_harmonic" not in node.executed


def test_a_correction_out_of_range_changes_nothing():
    _, inside, axis = stage()
    before = axis.correction()
    for wrong in ({**VALUES, "gain": 0}, {**VALUES, "cosine": [1 << 23] * 10}):
        with pytest.raises(Refused, match="outside"):
            axis.set_correction(wrong)
    with pytest.raises(OutOfRange, match="does not fit on the bus"):
        axis.set_correction({**VALUES, "sin_offset": 1 << 15})
    assert axis.correction() == before


# ---- signal, capture, compare


def test_signal_faults_are_reported_by_name_and_in_words():
    _, inside, axis = stage()
    inside.signal = dict(faults=1 << 9 | 1 << 14, first=1 << 9)
    signal = axis.signal()
    assert signal.faults == ("channel_missing", "lost_count") and signal.first == (
        "channel_missing",
    )
    assert signal.first_words == "the comparators change, a channel never changes its sign"


def test_captures_are_read_oldest_first_and_losses_are_reported():
    node, _, axis = stage()
    node.captures = [
        [0b0001 | 40 << 7, 1000, 65536, 0],
        [0b1100, 2000, -65536 & 0xFFFFFFFF, 0xFFFF],
    ]
    node.registers[0xC64] = 64
    captures, lost = axis.captures()
    assert lost and [(c.sources, c.position_nm, c.time_clk) for c in captures] == [
        (("index",), 800, 1000),
        (("software", "probe_0_rising"), -800, 2000),
    ]
    assert captures[0].age_s == 1e-5 and node.written[-1] == (0xC64, 64) and node.captures == []
    node.registers[0xC64] = 0
    assert axis.captures() == ([], False)


def test_capture_sources_are_selected_by_name():
    node, _, axis = stage()
    axis.capture_from("probe_1_falling", "index")
    assert node.written == [(0xC60, 0b1000001), (0xC10, 1)]
    axis.capture_from()
    axis.capture_now()
    assert node.written[2:] == [(0xC60, 0), (0xC10, 1 << 5)]
    with pytest.raises(UnknownName, match="no capture source 'probe': known are index, tick"):
        axis.capture_from("probe")


def test_compare_is_set_up_completely_and_armed_last():
    node, _, axis = stage()
    axis.compare_from("0.8mm", "-80um", 5, "2us", "1ms")
    words = dict(node.written)
    assert node.written[0] == (0xC10, 1 << 9) and node.written[-1] == (0xC10, 1 << 8)
    assert words[0xC78] | words[0xC7C] << 32 == 1000 * 65536
    assert words[0xC80] | words[0xC84] << 32 == (1 << 48) - 100 * 65536
    assert (words[0xC88], words[0xC8C], words[0xC90], words[0xC94]) == (5, 8, 4000, 2)
    node.registers.update({0xC94: 3, 0xC98: 4})
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
    _, _, axis = stage()
    for wrong in ((2, 0), (-4, 0), (65536, 0), (0xC60, -1), (0xC60, 1 << 32)):
        with pytest.raises(OutOfRange, match="32-bit words"):
            axis.node.write_register(*wrong)
    with pytest.raises(Refused, match=r"no register at this address \(address 0x0400\)"):
        axis.node.write_register(0x400, 0)


# ---- the command line


def test_calibrate_save_clear_load_on_the_command_line(tmp_path):
    node, file = FakeNode(), str(tmp_path / "correction.json")
    call = Call("home -- calibrate --distance 80um --timeout 1min -- correction show", node)
    assert (
        call.code == 0 and "calibrated in" in call.out and "known to 0.020 nm, frozen" in call.out
    )
    assert "harmonics of the phase, nm: 1: 0.000" in call.out and not node.axes[0].enabled
    node.axes[0].correction["sin_offset"] = 77
    assert Call(["correction", "save", file], node).out == f"correction saved in {file}\n"
    other = FakeNode()
    assert (
        Call(["correction", "load", file], other).code == 0
        and other.axes[0].correction["sin_offset"] == 77
    )
    for action, frozen in (("calibrate", 0), ("freeze", 1), ("clear", 1)):
        assert (
            Call(f"correction {action}", node).code == 0
            and node.axes[0].calibration_state["frozen"] == frozen
        )
    assert "not settled" in Call("correction show", node).out


def test_a_calibration_that_fails_is_exit_code_1_with_its_cause():
    node = FakeNode()
    node.axes[0].moves_to_calibrate = None
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
            ["home", "--", "calibrate"], lambda _: FakeBus(FakeNode()), io.StringIO(), err
        )
        == 0
    )
    assert "calibrating; not settled (0 accepted, 0 refused)" in err.getvalue()


def test_signal_capture_and_compare_on_the_command_line():
    node = FakeNode()
    assert "nothing is wrong with the signal\n  first since reset: none" in Call("signal", node).out
    node.axes[0].signal = dict(faults=1, first=3)
    assert (
        "signal too small\n  first since reset: signal too small, signal too large"
        in Call("signal", node).out
    )
    node.captures = [[0b0010, 1000, 65536, 0]]
    call = Call("capture from tick software -- capture now -- capture read -- capture from", node)
    assert (
        call.code == 0
        and "captures from tick, software" in call.out
        and "captures from nothing" in call.out
    )
    assert "1 captures\n  0.000800 mm at cycle 1000, its sample 0.00 us before: tick" in call.out
    node.registers.update({0xC94: 1, 0xC98: 2})
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
    node = FakeNode()
    node.registers.update({0xC94: 0, 0xC98: 0})
    node.captures = [[1, 2, 3, 0]]
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
    node = FakeNode()
    assert message in sentence(Call(text, node), 2)
    assert node.written == []


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"correction": 3}', "{", '{"correction": {"gain": 65536}}']
)
def test_a_file_that_holds_no_correction_is_refused(tmp_path, text):
    node, file = FakeNode(), tmp_path / "wrong.json"
    file.write_text(text)
    sentence(Call(["correction", "load", str(file)], node), 2)
    assert "set_correction" not in node.executed

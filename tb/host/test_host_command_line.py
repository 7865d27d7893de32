# SPDX-License-Identifier: Apache-2.0
"""moire.cli: what the commands do, one after the other in one call."""

import json

import pytest

from moire.analysis import tune
from moire.made.bus_tables import PARAMETERS
from tb.fakes.bus_node import START, BusNode
from tb.host.call import Call, sentence
from twin.compiled.axis import Axis
from twin.compiled.tables import DEFINES, FAULT, PERIOD


def test_home_move_status_in_one_call_and_the_drive_is_off_at_its_end():
    node = BusNode()
    call = Call("home -- move 1mm -- move -200um --by -- status", node)
    assert call.code == 0 and call.err == ""
    assert "at 1.000000 mm, error 0.0 nm" in call.out
    assert "holding position, zero known\n  position  0.800000 mm   160000 counts" in call.out
    assert not node.axes[0].enabled and node.axes[0].faults == 0 and call.bus.closed


def test_a_drive_that_was_on_before_is_left_to_its_owner():
    node = BusNode()
    node.home(on=True)
    assert Call("status", node).code == 0 and node.axes[0].enabled
    assert Call("disable", node).code == 0 and not node.axes[0].enabled


def test_drives_are_switched_off_after_an_error_too():
    node = BusNode()
    assert Call("enable -- move 1mm", node).code == 1
    assert not node.axes[0].enabled


@pytest.mark.parametrize(
    "command", ["move 1mm", "move 1mm --no-wait", "move 1mm --by", "prepare 1mm"]
)
def test_a_move_of_an_axis_that_is_not_homed_is_refused_before_its_drive_is_switched_on(command):
    node = BusNode()
    named = command.partition(" ")[0]
    refused = f"moire: node 1 refused '{named}': the axis has no zero yet: home it first\n"
    call = Call(command, node)
    assert (call.code, call.err) == (1, refused) and "enable" not in node.executed
    on = Call(f"enable -- {command}", BusNode())
    assert (on.code, on.err) == (1, refused)  # in the words of the node


def test_a_faulted_axis_that_is_not_homed_is_refused_for_its_fault():
    node = BusNode()
    node.axes[0].causes = FAULT["estop"]
    node.run(1)
    assert "a fault is latched" in sentence(Call("move 1mm", node), 1)


def test_options_of_the_first_command_hold_for_all_and_may_be_given_again():
    nodes = BusNode(1), BusNode(2, axes=2)
    call = Call(
        "--address 2 home --axis 1 -- status -- status --axis 0 "
        "-- status --address 1 --axis 0 --json",
        *nodes,
    )
    assert [(result["address"], result["axis"]) for result in call.results] == [
        (2, 1),
        (2, 1),
        (2, 0),
        (1, 0),
    ]
    assert nodes[1].homed(1) and not nodes[1].homed(0)


def test_find_lists_the_nodes_and_marks_those_of_another_build():
    call = Call("find 1 3", BusNode(1), BusNode(3, map_crc=1, axes=2))
    assert call.code == 0
    assert call.out.splitlines()[0].startswith(
        "node 1: 1 axis, clock 4 MHz, servo 4 kHz, samples 100 kHz, made from the same sources"
    )
    assert "node 3: 2 axes" in call.out and "MADE FROM OTHER SOURCES" in call.out
    assert [
        node["matches"]
        for node in Call("find --json", BusNode(1), BusNode(3, map_crc=1)).results[0]["nodes"]
    ] == [True, False]


def test_find_tries_the_usual_baud_rates_and_reports_the_one_found():
    node = BusNode(2)
    node.use_baud(500_000)
    assert "or try all with 'find --any-baud'" in sentence(Call("find", node), 3)
    node = BusNode(2)  # the other one has returned to its first rate, since nobody called it
    node.use_baud(500_000)
    call = Call("find --any-baud -- status --address 2", node)
    assert (
        call.code == 0 and "at 500000 baud: --baud 500000" in call.out and "drive off" in call.out
    )
    node.use_baud(500_000)
    assert Call("find --any-baud --json", node).results[0]["baud"] == 500_000
    assert "check power and wiring; no usual baud rate is left" in sentence(
        Call("find 5 --any-baud", node), 3
    )


def test_enable_wait_stop_reset_encoder_counters():
    node = BusNode()
    node.home()
    call = Call("enable -- wait 0.5s -- stop -- disable -- reset -- encoder -- counters", node)
    assert call.code == 0 and call.bus.clock > 0.5
    assert "drive on" in call.out and "no fault is latched" in call.out
    assert "margin 77 %" in call.out and "frames_good" in call.out and "no_answer" in call.out


def test_a_node_without_sine_and_cosine_reports_it():
    node = BusNode(absent=("sine", "monitor", "harmonics", "recorder"))
    call = Call("status -- encoder", node)
    assert (
        call.out.count("counts only: built without sine and cosine") == 2
        and "ADC counts" not in call.out
    )
    assert [result["sine"] for result in Call("status -- encoder --json", node).results] == [
        False,
        False,
    ]
    refusal = sentence(Call("signal", node), 1)
    assert "built without this function (it needs HAS_MONITOR of rtl/node.sv)" in refusal
    call = Call("status -- encoder")
    assert "without" not in call.out and "ADC counts" in call.out


def test_what_an_axis_was_built_with_is_listed_with_its_parameters():
    node = BusNode(absent=("compare", "fine_stage", "segments"))
    rows = dict(row.split(None, 1) for row in Call("built", node).out.splitlines()[1:])
    assert rows["HAS_COMPARE"] == rows["HAS_FINE_STAGE"] == rows["SEGMENTS"] == "not built"
    assert rows["HAS_STEPPER"] == "built" and rows["FILTERS"] == "up to 2"
    result = Call("built --json", node).results[0]
    assert (result["compare"], result["drive"], result["filters"]) == (0, 1, 2)


@pytest.mark.parametrize(
    "command, parameter",
    [
        ("enable", "HAS_DRIVE"),
        ("move 1mm", "HAS_DRIVE"),
        ("params set kp 1", "HAS_DRIVE"),
        ("params set drive steps", "HAS_STEPPER"),
        ("params set fine_reach 1um", "HAS_FINE_STAGE"),
        ("compare off", "HAS_COMPARE"),
    ],
)
def test_a_refusal_names_the_parameter_that_builds_what_is_missing(command, parameter):
    node = BusNode(absent=("drive", "stepper", "fine_stage", "compare"))
    assert f"(it needs {parameter} of rtl/node.sv)" in sentence(Call(command, node), 1)


def test_registers_by_address_and_by_name():
    node = BusNode()
    node.port.count("START_GLITCHES", 258)
    address = DEFINES["BUS_BASE"] + DEFINES["BUS_START_GLITCHES"]
    call = Call(f"register {address:#x} {address} bus.start_glitches axis.control", node)
    assert call.code == 0
    assert (
        f"{address:#x} = 0x00000102 258\n{address} = 0x00000102 258\n"
        "bus.start_glitches: value = 258\naxis.control: enable = 0" in call.out
    )
    assert "axis.position" in Call("register").out
    assert Call(f"register {address:#x} --json", node).results[0]["registers"] == {
        f"{address:#x}": 258
    }


def test_parameters_are_listed_set_and_read_back():
    node = BusNode()
    call = Call("params set velocity 5mm/s -- params get velocity kp -- params list", node)
    assert call.code == 0 and node.parameter("velocity") == 6250
    rows = call.out.splitlines()
    assert rows[0].split()[:2] == ["velocity", "5mm/s"] and "800nm/s to 800mm/s" in rows[0]
    assert len(rows) == 1 + 2 + len(PARAMETERS)
    assert (
        Call("params set travel_low -1.5mm", node).code == 0
        and node.parameter("travel_low") == -1875 * 65536
    )
    assert Call("params get period --json", node).results[0]["parameters"][0]["value"] == 800


def test_parameters_are_saved_and_loaded(tmp_path):
    node, file = BusNode(), str(tmp_path / "stage.json")
    node.set(settle_window=1639)
    assert (
        Call(["params", "save", file], node).out
        == f"{len(PARAMETERS)} parameters saved in {file}\n"
    )
    assert json.loads(open(file).read())["parameters"]["acceleration"] == "100mm/s2"
    other = BusNode()
    assert (
        Call(["params", "load", file], other).code == 0 and other.parameters() == node.parameters()
    )


def test_two_axes_begin_together():
    node = BusNode(axes=2)
    call = Call("home -- home --axis 1 -- prepare 1mm -- prepare 2mm --axis 1 -- start 0 1", node)
    assert call.code == 0, call.err
    assert (
        "node 1 axis 0: at 1.000000 mm, error 0.0 nm\nnode 1 axis 1: at 2.000000 mm, error 0.0 nm"
        in call.out
    )
    assert sentence(Call("home -- prepare 1mm -- start 0 1", BusNode(axes=2)), 1).endswith(
        "the axis has no motion prepared\n"
    )


def test_the_drives_of_several_nodes_stay_on_while_one_of_them_moves():
    nodes = BusNode(1), BusNode(2)
    call = Call(
        "home -- home --address 2 -- move 10mm -- watch --address 2 --for 1s -- prepare 1mm "
        "-- prepare 1mm --address 2 -- start 1.0 2.0",
        *nodes,
    )
    assert call.code == 0, call.err
    assert call.bus.clock > 4 and [node.axes[0].faults for node in nodes] == [0, 0]
    assert call.out.count("at 1.000000 mm") == 2


def test_a_motion_is_slowed_paused_resumed_and_awaited():
    node = BusNode()
    call = Call(
        "home -- override 50% -- move 1mm --no-wait -- pause -- wait 2s "
        "-- resume -- finish -- override",
        node,
    )
    assert call.code == 0, call.err
    rows = call.out.splitlines()
    assert (
        rows[1].endswith("50 % of full speed")
        and "on its way" in rows[2]
        and rows[3].endswith("paused")
    )
    assert "moving" in rows[4] and any("at 1.000000 mm, error 0.0 nm" in row for row in rows)
    assert rows[-1].endswith("50 % of full speed")
    overrides = [
        fields["value"]
        for fields in node.written("set_parameter")
        if fields["parameter"] == PARAMETERS["feed_override"].id
    ]
    assert overrides == [1 << 15, 0, 1 << 15]


def test_home_takes_a_method():
    node = BusNode(axes=[Axis(START, index=[START + PERIOD])])
    assert Call("home --method 35", node).code == 0 and node.parameter("home_method") == 35
    assert Call("home --method s3", node).code == 0 and node.parameter("home_method") == -2


def test_the_drive_and_choices_in_words():
    node = BusNode(absent=("fine_stage",))
    node.set_actuator(DRIVE=1, STEPS=25)
    call = Call("drive -- params set drive steps -- register actuator.steps", node)
    assert call.code == 0, call.err
    assert (
        "drive     steps; built: bridge, steps, dac\n" in call.out
        and "25 on the wire" in call.out
        and "fine" not in call.out
    )
    assert "bridge, steps, dac" in call.out and node.parameter("drive") == 1
    assert "'sideways': allowed are bridge, steps, dac" in sentence(
        Call("params set drive sideways", node), 2
    )


def test_tune_reads_a_record_reports_gains_and_writes_them(tmp_path):
    node, record, picture = BusNode(), tmp_path / "record.csv", tmp_path / "tuning.png"
    position = velocity = 0.0
    rows = ["command,position"]
    for command in tune.excitation(1000, 8000):
        rows.append(f"{command},{round(position)}")
        velocity += 0.05 * (0.2 * command - velocity)
        position += velocity
    record.write_text("\n".join(rows))
    call = Call(
        ["tune", str(record), "--bandwidth", "40Hz", "--picture", str(picture), "--json"], node
    )
    assert call.code == 0, call.err
    result = call.results[0]
    assert (
        result["plant"]["a"] == pytest.approx(0.95, rel=0.01)
        and not result["written"]
        and picture.read_bytes().startswith(b"\x89PNG")
    )
    assert "set_parameter" not in node.executed
    call = Call(["tune", str(record), "--bandwidth", "40Hz", "--tick", "250us", "--write"], node)
    assert call.code == 0 and "written to node 1 axis 0" in call.out
    assert node.parameter("kp") == round(result["gains"]["kp"] * 65536) > 0
    written = node.parameters()
    call = Call(["tune", str(record), "--check", "--json"], node)
    assert call.code == 0 and call.results[0]["bandwidth_hz"] == pytest.approx(40, rel=0.05)
    kept = tmp_path / "before.json"
    call = Call(["tune", str(record), "--write", "--keep", str(kept)], node)
    assert call.code == 0 and node.parameter("kp") > written["kp"], "as fast as the margins allow"
    assert "loop, in force: 4" in call.out and "loop, gains alone:" in call.out
    assert Call(["tune", "--undo", str(kept)], node).code == 0 and node.parameters() == written
    kept.write_text('{"kp": 5}')
    assert "has no gains and filters" in sentence(Call(["tune", "--undo", str(kept)], node), 2)
    node.force("kp", 100 * written["kp"])
    refused = sentence(Call(["tune", str(record), "--check"], node), 1)
    assert "has a phase margin of 6 degrees" in refused and "set kp to 1." in refused
    assert node.parameters() == {**written, "kp": 100 * written["kp"]}, "a check changes nothing"


@pytest.mark.parametrize(
    "options, message",
    [
        ("--check --bandwidth 40Hz", "--check and --bandwidth do not go together"),
        ("--check --write", "--check and --write do not go together"),
        ("--method response", "--method response and FILE do not go together"),
        ("--method guess", "there is no method 'guess'"),
        ("--keep before.json", "--keep goes with --write"),
        ("--undo before.json", "--undo and file do not go together"),
        ("--speed -1mm/s", "below zero"),
        ("--peak 0%", "not above zero"),
    ],
)
def test_options_of_tune_that_contradict_each_other_are_refused(options, message):
    assert message in sentence(Call(f"tune record.csv {options}"), 2)


@pytest.mark.parametrize(
    "text, message",
    [
        ("1,2,3\n1,2,3", "is no record"),
        ("1,x\n2,3", "is no record"),
        ("", "is no record"),
        ("command,position\n1,2", "too few"),
    ],
)
def test_a_file_that_is_no_record_is_refused(tmp_path, text, message):
    record = tmp_path / "record.csv"
    record.write_text(text)
    call = Call(["tune", str(record), "--bandwidth", "40Hz"])
    assert call.code in (1, 2) and message in call.err and call.err.count("\n") == 1

# SPDX-License-Identifier: Apache-2.0
"""command_line: sequences, exit codes, JSON, files, the shell. Every error is one sentence that
states what is allowed.
"""

import importlib.metadata
import io
import json
import os
import re
import subprocess
import sys
import threading

import pytest

from experiments import machines
from moire.analysis import tune
from moire.bus.twin_port import MACHINES
from moire.cli import command_line, completion, shell
from moire.errors import PortError
from moire.made.bus_tables import PARAMETERS
from tb.fakes.bus_node import START, BusNode
from tb.fakes.rs485_bus import Rs485Bus
from twin import BuildError
from twin.compiled.axis import Axis
from twin.compiled.tables import DEFINES, FAULT, PERIOD


class Call:
    """One call of `moire` against nodes on a bus."""

    def __init__(self, text, *nodes, bus=None):
        self.bus = bus or Rs485Bus(*(nodes or [BusNode()]))
        self.options, out, err = None, io.StringIO(), io.StringIO()

        def open_transport(options):
            self.options = options
            return self.bus

        arguments = text.split() if isinstance(text, str) else text
        self.code = command_line.main(arguments, open_transport, out, err)
        self.out, self.err = out.getvalue(), err.getvalue()

    @property
    def results(self):
        return [json.loads(row) for row in self.out.splitlines()]


def sentence(call, code):
    """The one line of the error message."""
    assert call.code == code and call.err.count("\n") == 1 and call.err.startswith("moire: "), (
        call.err
    )
    return call.err


# ------------------------------------------------------------------ what it does


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


# ------------------------------------------------------------------ JSON


@pytest.mark.parametrize(
    "text",
    [
        "find",
        "status",
        "enable",
        "disable",
        "home",
        "home -- move 1mm",
        "stop",
        "wait 1ms",
        "reset",
        "counters",
        "encoder",
        "register",
        "register 0x400",
        "params list",
        "params get kp",
        "params set kp 0.1",
        "home -- move 1mm --no-wait -- pause -- resume -- finish",
        "home -- prepare 1mm -- start 0",
        "override",
        "override 50%",
        "scope arm -- scope show",
        "watch --for 0s",
        "fault",
        "selftest",
    ],
)
def test_every_command_prints_one_json_object_per_line(text):
    for arguments in (text + " --json", "--json " + text):
        node = BusNode()
        node.ask("enable", axis=0, on=1)
        call = Call(arguments, node)
        assert call.code == 0 and call.err == ""
        assert [result["command"] for result in call.results] == [
            part.split()[0] for part in text.split(" -- ")
        ]


def test_status_in_json_has_numbers_and_words():
    node = BusNode()
    node.axes[0].causes = FAULT["estop"]
    node.run(1)
    result = Call("status --json", node).results[0]
    assert (
        result["faults"] == ["estop"]
        and result["fault_words"] == "emergency stop"
        and result["state"] == "faulted"
    )
    assert result["position_nm"] == pytest.approx(START / 65536 * 800) and result["homed"] is False


def test_errors_are_json_too():
    assert Call("move 1mm --json").results == [
        {
            "command": "move",
            "error": "Refused",
            "message": "node 1 refused 'move': the axis has no zero yet: home it first",
            "exit_code": 1,
            "cause": "not_homed",
        }
    ]
    result = Call("move 1 --json").results[0]
    assert (
        result["error"] == "UsageError"
        and result["exit_code"] == 2
        and "such as 1.5mm" in result["message"]
    )


@pytest.mark.parametrize(
    "text, command",
    [
        ("status -- move 1", "move"),
        ("fly", "fly"),
        ("params get speed", "params"),
        ("params fly", "params"),
        ("--baud 0 status", "status"),
        ("move 1mm --address", "move"),
        ("status -- shell", "shell"),
        ("", None),
    ],
)
def test_a_usage_error_names_its_command(text, command):
    (result,) = Call(["--json", *text.split()] if text else ["--json", "--"]).results
    assert (
        result["command"] == command
        and result["error"] == "UsageError"
        and result["exit_code"] == 2
    )


def test_no_value_of_an_answer_overwrites_the_name_of_the_command():
    node = BusNode(absent=("fine_stage",))
    node.set_actuator(DRIVE=1, STEPS=25)
    result = Call("drive --json", node).results[0]
    assert result["command"] == "drive" and result["drive_command"] == 0 and result["steps"] == 25


# ------------------------------------------------------------------ errors and exit codes


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "a command is missing"),
        ("status --", "a command is missing beside --"),
        ("-- status", "a command is missing beside --"),
        ("fly", "there is no command 'fly' (see: moire --help)"),
        ("hom", "there is no command 'hom', did you mean home?"),
        ("capture reed", "there is no command 'reed', did you mean read?"),
        ("status --adress 2", "there is no option '--adress', did you mean --address"),
        ("move 1mm 2mm", "'2mm' is one argument too many (see: moire move --help)"),
        ("status --port", "requires an argument"),
        ("job load", "give either FILE or --equal N"),
        ("move 1", "'1' has no unit: write a number with pm nm um mm cm m"),
        ("move fast", "'fast' is no length"),
        ("move", "LENGTH is missing"),
        ("wait 5mm", "'5mm' is no time: write a number with ns us ms s min h, such as 20ms"),
        ("wait -1s", "in the past"),
        ("status --address 16", "'16' is no address: allowed are 1 to 15"),
        ("status --address x", "allowed are 1 to 15"),
        ("find 0", "allowed are 1 to 15"),
        ("status --axis -1", "'-1' is no axis: the first is 0"),
        ("status --baud 0", "'0' is no whole number above 0"),
        ("status --parity even", "there is no parity 'even': allowed are auto, mark, odd, none"),
        ("params", "an ACTION is missing (see: moire params --help)"),
        ("params get speed", "there is no parameter 'speed': 'moire params list' lists all"),
        ("params get velocty", "did you mean velocity or velocity_quantum?"),
        ("params set velocity", "VALUE is missing"),
        ("params set velocity 900mm/s", "velocity allows 800nm/s to 800mm/s, not 900mm/s"),
        ("params set velocity 5mm", "'5mm' is no speed"),
        ("params set kp x", "'x' is no number: write a plain number, such as 0.5"),
        ("override 120%", "'120%' is no share of full speed: write 0% to 100%, or 0 to 1"),
        ("home --method zero", "'zero' is no method: allowed are a number of CiA 402, s0, s3"),
        ("start", "AXIS is missing"),
        ("tune --undo /no/such/file", "the file /no/such/file cannot be read"),
        ("tune /no/such/file --bandwidth 40Hz", "cannot be read"),
        ("register axis.speed", "there is no register 'axis.speed'"),
        ("register 0x401", "multiples of 4"),
        ("register 0xg", "'0xg' is no register address"),
        ("params load /no/such/file", "the file /no/such/file cannot be read: No such file"),
        ("params save /no/such/file", "cannot be written"),
        ("run /no/such/file", "cannot be read"),
        ("status -- shell", "'shell' must be the only command of its call"),
    ],
)
def test_wrong_usage_is_one_sentence_and_exit_code_2(text, message):
    node = BusNode()
    assert message in sentence(Call(text, node), 2)
    assert "set_parameter" not in node.executed


def test_nothing_moves_when_a_later_command_is_wrong():
    node = BusNode()
    sentence(Call("home -- move 1mm -- move 2", node), 2)
    assert node.executed == []


def test_a_refusal_is_exit_code_1():
    assert "home it first" in sentence(Call("move 1mm"), 1)
    assert "outside the travel (target 1000mm, allowed -800um to 119.6mm)" in sentence_of_last(
        "home -- move 1m", 1
    )
    assert "no such axis" not in sentence(Call("status --axis 3"), 1)


def sentence_of_last(text, code):
    return sentence(Call(text), code)


def test_a_motion_that_ends_badly_is_exit_code_1():
    node = BusNode()
    node.axes[0].low_at = None  # there is no switch
    node.set(travel_low=0, travel_high=0)
    assert "no limit switch was found within the travel" in sentence(Call("home", node), 1)
    result = Call("home --json", node).results[-1]
    assert (result["error"], result["cause"]) == ("MotionFailed", "no_switch")


def test_silence_and_noise_are_exit_code_3():
    assert "nobody answers at address 5, asked 5 times" in sentence(Call("status --address 5"), 3)
    assert "nobody answers at the addresses 3, 4" in sentence(Call("find 3 4"), 3)
    bus = Rs485Bus(BusNode())
    bus.from_nodes = lambda word: [word ^ 1]
    assert "garbled" in sentence(Call("status", bus=bus), 3)


def test_two_nodes_with_one_address_are_exit_code_3():
    bus = Rs485Bus(BusNode(), BusNode())
    bus.nodes[1].clk += 1_200_000  # it was powered up 0.3 s before the other
    assert "two nodes with the address 1" in sentence(Call("find", bus=bus), 3)


def test_ports_are_exit_code_4(monkeypatch):
    monkeypatch.delenv("MOIRE_PORT", raising=False)
    err = io.StringIO()
    assert (
        command_line.main(["status"], err=err) == 4
        and "write --port /dev/ttyUSB0, or --port twin" in err.getvalue()
    )
    monkeypatch.setenv("MOIRE_PORT", "/dev/no_such_port")
    err = io.StringIO()
    assert (
        command_line.main(["status"], err=err) == 4
        and err.getvalue() == "moire: there is no port /dev/no_such_port\n"
    )


def test_without_a_checkout_the_port_twin_reports_what_to_do(monkeypatch):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: ())
    err = io.StringIO()
    assert command_line.main(["--port", "twin", "status"], err=err) == 4
    assert err.getvalue() == (
        "moire: the simulated machine needs a checkout of Moire: run `make demo` there and use its "
        "build/venv/bin/moire\n"
    )


def test_a_twin_that_does_not_build_is_exit_code_4(monkeypatch):
    def broken(_):
        raise BuildError("g++ is missing")

    monkeypatch.setitem(machines.MACHINES, "s0", broken)
    err = io.StringIO()
    assert command_line.main(["--port", "twin", "status"], err=err) == 4
    assert err.getvalue() == "moire: the simulated machine cannot be built: g++ is missing\n"


def test_a_simulated_machine_that_does_not_exist_is_named():
    err = io.StringIO()
    assert command_line.main(["--port", "twin:s9", "status"], err=err) == 2
    assert (
        err.getvalue()
        == f"moire: there is no simulated machine 's9': known are {', '.join(MACHINES)}\n"
    )
    assert "--nodes is for s0: the nodes of s2 have their addresses" in sentence(
        Call("twin --machine s2 --nodes 1"), 2
    )
    assert "there is no machine 's9'" in sentence(Call("twin --machine s9"), 2)


def test_another_build_is_exit_code_5():
    assert "0000BEEF in the node" in sentence(Call("status", BusNode(map_crc=0xBEEF)), 5)


def test_ctrl_c_stops_the_axis_and_is_exit_code_130():
    node = BusNode()
    bus = Rs485Bus(node)

    def interrupt():
        raise KeyboardInterrupt

    bus.at.append((0.2, interrupt))
    call = Call("home", bus=bus)
    assert "interrupted; what moved was stopped under control" in sentence(call, 130)
    assert node.ended() == "stopped"
    assert "stop" in node.executed and not node.axes[0].enabled and bus.closed


def test_ctrl_c_in_another_command_stops_what_moves_too():
    node = BusNode()
    node.home()
    bus = Rs485Bus(node)

    def interrupt():
        raise KeyboardInterrupt

    bus.at.append((0.5, interrupt))
    assert Call("move 100mm --no-wait -- watch --json", bus=bus).results[-1]["exit_code"] == 130
    assert node.executed[-1] == "enable" and "stop" in node.executed and node.ended() == "stopped"
    assert node.axes[0].position < 10_000_000 * 65536 // 800


def test_an_output_that_nobody_reads_any_more_stops_the_axis():
    node = BusNode()
    node.home()
    reader, writer = os.pipe()
    os.close(reader)
    with pytest.raises(BrokenPipeError), os.fdopen(writer, "w") as out:
        out.write("x")
        out.flush()
    reader, writer = os.pipe()
    os.close(reader)
    err, out = io.StringIO(), os.fdopen(writer, "w")
    arguments = ["move", "100mm", "--no-wait"]
    bus = Rs485Bus(node)
    assert command_line.main(arguments, lambda _: bus, out, err) == 0 and err.getvalue() == ""
    assert "stop" in node.executed and node.ended() == "stopped" and bus.closed


def test_a_full_disk_is_one_sentence_and_stops_the_axis():
    node, err = BusNode(), io.StringIO()
    node.home()
    for more in ([], ["--json"]):
        with open("/dev/full", "w") as out:
            arguments = ["move", "100mm", "--no-wait", *more]
            assert command_line.main(arguments, lambda _: Rs485Bus(node), out, err) == 2
        assert node.ended() == "stopped" and not node.axes[0].enabled
    sentence = "moire: the output cannot be written: No space left on device\n"
    assert err.getvalue() == 2 * sentence


@pytest.mark.parametrize("arguments", [["register"], ["--help"], ["register", "--json", "x"]])
def test_a_program_whose_output_cannot_be_written_ends_without_a_traceback(arguments):
    with open("/dev/full", "w") as out:
        ended = subprocess.run(
            [sys.executable, "-m", "moire", *arguments], stdout=out, stderr=subprocess.PIPE
        )
    assert ended.returncode == 2 and ended.stderr.count(b"\n") == 1


def test_baud_and_parity_reach_the_port():
    call = Call("status --baud 9600 --parity odd --port COM3")
    assert (call.options.port, call.options.baud, call.options.parity) == ("COM3", 9600, "odd")
    call = Call("status -- status --baud 9600")
    assert call.options.baud == 9600


@pytest.mark.parametrize(
    "option, tries, patience_s",
    [("", 5, 0.1), ("--patience 2s", 5, 2), ("--timeout 2s --tries 3", 3, 2)],
)
def test_each_of_the_tries_has_the_patience_that_is_given(option, tries, patience_s):
    bus = Rs485Bus(BusNode())
    bus.from_nodes = lambda word: []
    assert f"asked {tries} times" in sentence(Call(f"status {option}", bus=bus), 3)
    assert tries * patience_s < bus.now() < tries * patience_s + 0.1


def test_help_names_every_command_and_gives_examples(capsys):
    for arguments, message in (
        (["--help"], "moire --port twin home -- move 1mm -- status"),
        (["move", "--help"], "example: moire"),
        (["params", "set", "--help"], "velocity 5mm/s"),
    ):
        with pytest.raises(SystemExit) as left:
            command_line.main(arguments)
        assert left.value.code == 0 and message in capsys.readouterr().out


def test_the_version_is_the_one_of_the_package(capsys):
    with pytest.raises(SystemExit) as left:
        command_line.main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"moire {importlib.metadata.version('moire')}\n"


def test_help_loads_neither_numpy_nor_matplotlib():
    program = (
        "import sys; from moire.cli import command_line\n"
        "try: command_line.main(['tune', '--help'])\n"
        "finally: print({'numpy', 'matplotlib', 'serial'} & set(sys.modules))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ended.returncode == 0 and ended.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize(
    "typed, offered",
    [
        ("moire mov", {"move"}),
        ("moire home -- move 1mm -- stat", {"status"}),
        ("moire home -- move 1mm --b", {"--by", "--baud"}),
        ("moire --port twin params get veloc", {"velocity", "velocity_quantum"}),
        ("moire params re", {"restore-defaults"}),
        ("moire status --parity m", {"mark"}),
    ],
)
def test_bash_completes_the_last_command_of_a_chain(typed, offered):
    words = {"COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    ended = subprocess.run(
        [sys.executable, "-m", "moire"],
        env={**os.environ, **words, "_MOIRE_COMPLETE": "bash_complete"},
        capture_output=True,
        text=True,
    )
    assert {row.removeprefix("plain,") for row in ended.stdout.split()} == offered
    assert set(completion.candidates(typed.removeprefix("moire "))) == offered


@pytest.mark.parametrize(
    "shell_name, words, offered",
    [
        ("zsh", {"COMP_WORDS": "moire home -- stat", "COMP_CWORD": "3"}, "status"),
        ("fish", {"COMP_WORDS": "moire home -- stat", "COMP_CWORD": "stat"}, "status"),
    ],
)
def test_zsh_and_fish_complete_the_last_command_too(shell_name, words, offered):
    def ask(what):
        return subprocess.run(
            [sys.executable, "-m", "moire"],
            env={**os.environ, **words, "_MOIRE_COMPLETE": f"{shell_name}_{what}"},
            capture_output=True,
            text=True,
        ).stdout

    assert offered in re.split(r"[\s,]", ask("complete"))
    assert f"_MOIRE_COMPLETE={shell_name}_complete" in ask("source")


# ------------------------------------------------------------------ files and the shell


def test_a_file_of_commands_is_carried_out(tmp_path):
    node, file = BusNode(), tmp_path / "warm up.txt"
    file.write_text("# to the zero\nhome\n\nmove 1mm   # there\nmove -0.5mm --by -- status\n")
    call = Call(["run", str(file), "--json"], node)
    assert call.code == 0 and [result["command"] for result in call.results] == [
        "home",
        "move",
        "move",
        "status",
    ]
    assert call.results[-1]["position_nm"] == 500_000 and not node.axes[0].enabled


def test_a_long_file_identifies_its_node_once(tmp_path):
    file, node = tmp_path / "many.txt", BusNode()
    file.write_text("status\n" * 300)
    call = Call(["run", str(file)], node)
    assert call.code == 0 and node.executed.count("status") == 300
    once = BusNode()
    Call("status", once)
    assert node.executed == once.executed[:2] + 300 * once.executed[2:]


@pytest.mark.parametrize(
    "text, message",
    [
        ("home\nmove 1\n", "line 2 of"),
        ("shell\n", "'shell' is not allowed in a file or a shell"),
        ("status --baud 9600\n", "--baud holds for the whole call"),
        ("move '1mm\n", "cannot be read: No closing quotation"),
    ],
)
def test_a_file_with_a_wrong_line_moves_nothing(tmp_path, text, message):
    node, file = BusNode(), tmp_path / "wrong.txt"
    file.write_text(text)
    assert message in sentence(Call(["run", str(file)], node), 2)
    assert node.executed == []


@pytest.mark.parametrize(
    "text", ["{", '"x"', "{}", '{"parameters": {"kp": 1}}', '{"parameters": []}']
)
def test_a_file_without_parameters_is_refused(tmp_path, text):
    node, file = BusNode(), tmp_path / "wrong.json"
    file.write_text(text)
    sentence(Call(["params", "load", str(file)], node), 2)
    assert "set_parameter" not in node.executed


def test_the_shell_keeps_the_drive_on_between_commands(monkeypatch):
    node = BusNode()
    monkeypatch.setattr(sys, "stdin", io.StringIO("home\nmove 1mm\nstatus\nquit\nfly\n"))
    call = Call("shell", node)
    assert call.code == 0 and "holding position, zero known" in call.out
    assert (
        node.executed.count("enable") == 2 and not node.axes[0].enabled
    )  # on once, off once at the end


def test_json_may_be_selected_for_a_single_line(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO("enable\nstatus --json\ndisable\n"))
    rows = Call("shell").out.splitlines()
    assert (
        rows[0].endswith("drive on")
        and json.loads(rows[1])["state"] == "holding"
        and rows[2].endswith("drive off")
    )


def test_commands_from_a_pipe_end_at_the_first_error(monkeypatch):
    node = BusNode()
    monkeypatch.setattr(sys, "stdin", io.StringIO("home\nfly\nmove 1mm\n"))
    assert "'fly'" in sentence(Call("shell", node), 2)
    assert "move" not in node.executed


def test_ctrl_c_in_the_shell_stops_what_moves(monkeypatch):
    class Keyboard:
        def isatty(self):
            return True

        def __iter__(self):
            yield from ("home\n", "move 100mm --no-wait\n")
            raise KeyboardInterrupt

    node = BusNode()
    monkeypatch.setattr(sys, "stdin", Keyboard())
    call = Call("shell", node)
    assert call.code == 0 and "stopped" in call.err and node.ended() == "stopped"


def test_the_shell_has_help(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO("help move\nhelp\n"))
    assert Call("shell").code == 0
    message = capsys.readouterr().out
    assert "Usage: moire move" in message and "Usage: moire [OPTIONS] COMMAND" in message


def test_a_shell_ends_when_its_node_no_longer_answers(monkeypatch):
    class Keyboard:
        def isatty(self):
            return True

        def __iter__(self):
            yield "enable\n"
            bus.nodes = ()
            for _ in range(500):
                threading.Event().wait(0.01)
                yield "\n"

    bus = Rs485Bus(BusNode())
    bus.time_is_stopped = False
    monkeypatch.setattr(sys, "stdin", Keyboard())
    monkeypatch.setattr(shell, "KEEP_ALIVE_S", 0.001)
    assert "nobody answers" in Call("shell", bus=bus).err


def test_a_person_may_mistype_in_the_shell(monkeypatch):
    class Keyboard(io.StringIO):
        def isatty(self):
            return True

    node = BusNode()
    monkeypatch.setattr(sys, "stdin", Keyboard("fly\nmove --help\nhome\nmove 1\nmove 1mm\n"))
    call = Call("shell", node)
    assert call.code == 0 and node.axes[0].position == 1250 * 65536
    assert "'fly'" in call.err and "'1' has no unit" in call.err and "moire> " in call.err


def test_a_waiting_shell_sends_requests_on_a_bus_in_real_time(monkeypatch):
    class Keyboard:
        """A keyboard that waits until the shell has sent a request by itself."""

        def isatty(self):
            return False

        def __iter__(self):
            yield "enable\n"
            for _ in range(500):
                if node.executed.count("status") >= 2:
                    break
                threading.Event().wait(0.01)
            yield "quit\n"

    node = BusNode()
    bus = Rs485Bus(node)
    bus.time_is_stopped = False
    monkeypatch.setattr(sys, "stdin", Keyboard())
    monkeypatch.setattr(shell, "KEEP_ALIVE_S", 0.01)
    assert Call("shell", bus=bus).code == 0 and node.executed.count("status") >= 2


def test_a_port_that_does_not_open_ends_the_shell_at_once(monkeypatch):
    def refuse(_):
        raise PortError("there is no port COM9")

    monkeypatch.setattr(sys, "stdin", io.StringIO("status\n"))
    assert command_line.main(["shell"], refuse, io.StringIO(), io.StringIO()) == 4

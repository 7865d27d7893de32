# SPDX-License-Identifier: Apache-2.0
"""moire.cli with --json: one object per line, for answers and for errors."""

import pytest

from tb.fakes.bus_node import START, BusNode
from tb.host.call import Call
from twin.compiled.tables import FAULT


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

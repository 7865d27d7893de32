# SPDX-License-Identifier: Apache-2.0
"""moire.cli: every error is one sentence that states what is allowed, with its exit code, and what
moves is stopped first.
"""

import io
import os
import subprocess
import sys

import pytest

from experiments import machines
from moire.bus.twin_port import MACHINES
from moire.cli import command_line
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus, port_of
from tb.host.call import Call, sentence
from twin import BuildError


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


@pytest.mark.parametrize("more, code", [("", 0), (" -- move 1m", 1)])
def test_what_still_moves_at_the_end_is_stopped_before_its_drive_is_switched_off(more, code):
    node = BusNode()
    node.home()
    bus, seen = Rs485Bus(node), []
    port_of(node).on_request = lambda name, fields: seen.append((name, fields, node.state()))
    assert Call("move 100mm --no-wait" + more, bus=bus).code == code
    assert seen[-1] == ("enable", {"axis": 0, "on": 0}, "holding")
    assert node.ended() == "stopped"


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

# SPDX-License-Identifier: Apache-2.0
"""moire.cli: files of commands and of parameters, and the shell without a terminal."""

import io
import json
import sys
import threading

import pytest

from moire.cli import command_line, shell
from moire.errors import PortError
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence


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

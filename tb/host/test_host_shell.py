# SPDX-License-Identifier: Apache-2.0
"""`moire shell` at a terminal: editing, history, completion, the end by a signal. What it does
without a terminal is tested in test_host_command_files.
"""

import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time

import pytest
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from moire.cli.terminal import SavedHistory, Terminal, Words

SHELL_AT_A_TERMINAL = """
import sys
from moire.cli import command_line
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
sys.exit(command_line.main(["shell"], lambda _: Rs485Bus(BusNode())))
"""


class AtTerminal:
    """A shell at a pseudo terminal, and what it has written there."""

    def __init__(self, folder):
        self.person, self.terminal = pty.openpty()
        self.before = termios.tcgetattr(self.terminal)
        self.seen = b""
        self.program = subprocess.Popen(
            [sys.executable, "-c", SHELL_AT_A_TERMINAL],
            stdin=self.terminal,
            stdout=self.terminal,
            stderr=self.terminal,
            env={
                **os.environ,
                "HOME": str(folder),
                "XDG_CONFIG_HOME": str(folder),
                "TERM": "xterm",
                "PROMPT_TOOLKIT_NO_CPR": "1",  # nobody answers where the cursor is
            },
        )

    def type(self, text):
        os.write(self.person, text)

    def until(self, text):
        """Waits for a text, and forgets what was written before its end."""
        end = time.monotonic() + 60
        while text not in self.seen and time.monotonic() < end:
            if select.select([self.person], [], [], 0.1)[0]:
                self.seen += os.read(self.person, 4096)
        assert text in self.seen, self.seen
        self.seen = self.seen.partition(text)[2]

    def close(self):
        self.program.kill()
        self.program.wait()
        os.close(self.person)
        os.close(self.terminal)


@pytest.fixture
def shell(tmp_path):
    shell = AtTerminal(tmp_path)
    try:
        yield shell
    finally:
        shell.close()


def test_a_terminal_has_line_editing_completion_and_history(tmp_path, shell):
    shell.until(b"moire>")
    shell.type(b"stt\bat\t")  # a typing error taken back, then the Tab key
    shell.until(b"us")
    shell.type(b"\r")
    shell.until(b"drive off")
    shell.until(b"moire>")
    shell.type(b"\x1b[A--json\r")  # the line before, and more
    shell.until(b'"command": "status"')
    shell.until(b"moire>")
    shell.type(b"quit\r")
    assert shell.program.wait(60) == 0
    (history,) = tmp_path.rglob("shell_history")
    lines = [line for line in history.read_text().splitlines() if line.startswith("+")]
    assert [line[1:].split() for line in lines] == [["status"], ["status", "--json"], ["quit"]]


def test_sigterm_at_the_prompt_ends_the_shell_and_restores_the_terminal(shell):
    shell.until(b"moire>")
    shell.type(b"home\r")
    shell.until(b"after ")
    shell.until(b"moire>")
    shell.program.send_signal(signal.SIGTERM)
    shell.until(b"ended by SIGTERM; what moved was stopped under control")
    assert shell.program.wait(60) == 143
    assert termios.tcgetattr(shell.terminal) == shell.before


def typed(keys, folder):
    """The lines that a terminal returns for these keys, up to Ctrl-D."""
    with create_pipe_input() as reader:
        terminal = Terminal(folder / "shell_history", reader, DummyOutput())
        lines = []
        reader.send_text(keys)
        while (line := terminal.line("moire> ")) is not None:
            lines.append(line)
        return lines


def test_the_lines_of_earlier_shells_come_back(tmp_path):
    assert typed("status\rmove 1mm\r\x04", tmp_path) == ["status", "move 1mm"]
    assert typed("\x1b[A\r\x04", tmp_path) == ["move 1mm"]
    earlier = SavedHistory(str(tmp_path / "shell_history")).load_history_strings()
    assert list(earlier) == ["move 1mm", "status"]


def test_ctrl_c_at_the_prompt_is_an_interrupt(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        typed("mov\x03", tmp_path)


@pytest.mark.parametrize("keys", ["status\r\x04", "\x1b[A\r\x04"])
def test_a_shell_without_a_place_for_its_history_works(tmp_path, keys):
    (tmp_path / "file").write_text("")
    (tmp_path / "shell_history").mkdir()
    expected = ["status"] if "status" in keys else [""]
    assert typed(keys, tmp_path / "file") == typed(keys, tmp_path) == expected


def test_the_words_that_may_follow_are_shown_with_their_meaning():
    document = Document("home -- move 1mm --b")
    found = {one.display_text: one for one in Words().get_completions(document, CompleteEvent())}
    assert set(found) == {"--by", "--baud"} and found["--by"].text == "--by "
    assert found["--by"].start_position == -3
    assert "distance" in found["--by"].display_meta_text

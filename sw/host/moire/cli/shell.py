# SPDX-License-Identifier: Apache-2.0
"""The lines of 'moire shell': from a terminal with line editing, history and completion, or from a
pipe.
"""

import sys
import threading
from collections.abc import Callable

from moire.cli.parser import parse_line
from moire.cli.session import Call, Session
from moire.cli.signals import Ended
from moire.description import settings_folder
from moire.errors import MoireError

KEEP_ALIVE_S = 0.1
HISTORY = "shell_history"  # the file in the folder of settings
PROMPT = "moire> "
LEAVE = ("quit", "exit")


def run_shell(call: Call) -> None:
    """Carry out lines until 'quit' or the end of the input."""
    session, person = call.session, sys.stdin.isatty()
    alive = KeptAlive(session)  # opens the port, so that a wrong one is reported now
    next_line = typed_lines() if at_terminal() else plain_lines(session, person)
    while True:
        try:
            with alive:
                text = next_line()
            if text is None or text.strip() in LEAVE:
                return
            for planned in parse_line(help_line(text), call.options, session.description):
                session.carry_out(planned)
        except MoireError as error:
            if not person or alive.failed:
                raise
            session.complain(error)
        except KeyboardInterrupt as interrupt:
            if not person or isinstance(interrupt, Ended):
                raise
            session.stop_axes()
            print("\nstopped", file=session.err)
        except SystemExit:
            pass  # --help


def at_terminal() -> bool:
    """Whether a line can be edited while it is typed."""
    return sys.stdin.isatty() and sys.stdout.isatty() and sys.stdin is sys.__stdin__


def help_line(text: str) -> str:
    """'help move' is 'move --help'."""
    words = text.split()
    return " ".join([*words[1:], "--help"]) if words[:1] == ["help"] else text


def typed_lines() -> Callable[[], str | None]:
    """What returns the next line that a person types at a terminal."""
    from moire.cli.terminal import Terminal  # takes a third of a second

    terminal = Terminal(settings_folder() / HISTORY)
    return lambda: terminal.line(PROMPT)


def plain_lines(session: Session, person: bool) -> Callable[[], str | None]:
    """What returns the next line of the standard input, without editing; None at its end."""
    lines = iter(sys.stdin)

    def next_line() -> str | None:
        if person:
            print(PROMPT, end="", file=session.err, flush=True)
        return next(lines, None)

    return next_line


class KeptAlive:
    """Keeps drives on while the shell waits for a line: a thread talks to their nodes. On a port
    whose time stands still while nobody talks there is nothing to do.
    """

    def __init__(self, session: Session) -> None:
        self.session, self.failed = session, False
        self.needed = not session.bus.transport.time_is_stopped

    def __enter__(self) -> None:
        self.error: MoireError | None = None
        self.end = threading.Event()
        self.thread = threading.Thread(target=self.talk, daemon=True)
        if self.needed:
            self.thread.start()

    def __exit__(self, *_: object) -> None:
        self.end.set()
        if self.needed:
            self.thread.join()
        if self.error is not None:
            self.failed = True
            raise self.error

    def talk(self) -> None:
        """Until the line is there, or until a node no longer answers."""
        while not self.end.wait(KEEP_ALIVE_S):
            try:
                self.session.keep_alive()
            except MoireError as error:
                self.error = error
                return

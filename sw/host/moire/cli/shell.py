# SPDX-License-Identifier: Apache-2.0
"""The lines of 'moire shell': from a terminal with line editing, history and completion, or from a
pipe.
"""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from moire.cli.completion import candidates
from moire.cli.parser import parse_line
from moire.cli.session import Call, Session
from moire.cli.signals import Ended
from moire.description import settings_folder
from moire.errors import MoireError

readline: ModuleType | None
try:
    import readline
except ImportError:  # Windows
    readline = None

KEEP_ALIVE_S = 0.1
LONGEST_HISTORY = 1000
PROMPT = "moire> "
LEAVE = ("quit", "exit")


def run_shell(call: Call) -> None:
    """Carry out lines until 'quit' or the end of the input."""
    session, person, lines = call.session, sys.stdin.isatty(), iter(sys.stdin)
    alive = KeptAlive(session)  # opens the port, so that a wrong one is reported now
    with history():
        while True:
            try:
                with alive:
                    text = next_line(session, lines, person)
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


def next_line(session: Session, lines: Iterator[str], person: bool) -> str | None:
    """The next line; None at the end of the input."""
    if at_terminal():
        try:
            return input(PROMPT)
        except EOFError:
            print(file=session.err)
            return None
    if person:
        print(PROMPT, end="", file=session.err, flush=True)
    return next(lines, None)


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


@contextmanager
def history() -> Iterator[None]:
    """Lines of earlier shells, and completion by the Tab key, where readline is there."""
    if readline is None or not at_terminal():
        yield
        return
    file = settings_folder() / "history"
    try:
        readline.read_history_file(file)
    except OSError:
        pass  # the first time
    readline.set_history_length(LONGEST_HISTORY)
    readline.set_completer_delims(" ")
    readline.set_completer(complete)
    readline.parse_and_bind("tab: complete")
    try:
        yield
    finally:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            readline.write_history_file(file)
        except OSError:
            pass  # a shell without history is better than none


def complete(_: str, number: int) -> str | None:
    """The candidates for the word before the cursor, one by one, as readline asks for them."""
    assert readline is not None
    found = candidates(readline.get_line_buffer()[: readline.get_endidx()])
    if len(found) == 1:
        found = [f"{found[0]} "]
    return found[number] if number < len(found) else None

# SPDX-License-Identifier: Apache-2.0
"""The command `moire`: find nodes, home and move axes, read and set parameters, from a shell or a
file.
"""

import os
import signal
import sys
from contextlib import closing
from typing import TextIO

from moire.cli import completion
from moire.cli.files import OutputError
from moire.cli.options import Options
from moire.cli.parser import moire, parse_call, parse_line
from moire.cli.session import Interrupted, OpenTransport, Session
from moire.cli.signals import Ended, ending_by_signals
from moire.description import Description, describe
from moire.errors import MoireError

__all__ = ["main", "moire", "parse_call", "parse_line"]


def main(
    arguments: list[str] | None = None,
    open_transport: OpenTransport | None = None,
    out: TextIO | None = None,
    err: TextIO | None = None,
) -> int:
    """Carry out one call of `moire`. Returns the exit code."""
    completion.answer_shell()
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    session = Session(Options(json="--json" in arguments), open_transport, out, err)
    with ending_by_signals():
        return carry_out(session, arguments)


def carry_out(session: Session, arguments: list[str]) -> int:
    """Carry out the commands and close the session. Returns the exit code."""
    try:
        with closing(session):
            return carry_out_commands(session, arguments)
    except MoireError as error:
        session.complain(error)
        return error.exit_code


def carry_out_commands(session: Session, arguments: list[str]) -> int:
    """Carry out the commands; an error is reported. Returns the exit code."""
    try:
        try:
            session.description = described(arguments)
            for planned in parse_call(arguments, session.description):
                session.carry_out(planned)
            return 0
        except OutputError:
            raise
        except MoireError as error:
            session.complain(error)
            return error.exit_code
        except KeyboardInterrupt as interrupt:
            session.stop_axes()
            number = interrupt.number if isinstance(interrupt, Ended) else signal.SIGINT
            ended = Interrupted(number)
            session.complain(ended)
            return ended.exit_code
    except OutputError as error:
        session.stop_axes()
        close_output(session.out)
        session.complain(error)
        return error.exit_code
    except BrokenPipeError:  # nobody reads any more, as in 'moire watch | head'
        session.stop_axes()
        close_output(session.out)
        return 0


def described(arguments: list[str]) -> Description:
    """The description of the machine for this call, which the parser needs to know names."""
    return describe(value_of(arguments, "--machine-file")).of(value_of(arguments, "--port"))


def value_of(arguments: list[str], option: str) -> str | None:
    """The value of an option, before the parser has read it; None without it."""
    for at, word in enumerate(arguments):
        if word == option:
            return next(iter(arguments[at + 1 :]), None)
        if word.startswith(f"{option}="):
            return word.partition("=")[2]
    return None


def close_output(out: TextIO) -> None:
    """Send what Python has not yet written nowhere, so that Python does not fail on it at its
    end.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())

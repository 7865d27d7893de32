# SPDX-License-Identifier: Apache-2.0
"""The commands that carry out commands: run takes them from a file, shell from the keyboard."""

import click

from moire.cli import shell as keyboard
from moire.cli.files import read_text
from moire.cli.parser import UsageError, moire, parse_line
from moire.cli.session import Call
from moire.cli.values import FILE
from moire.errors import MoireError


@moire.command(
    "run",
    help="Carry out the commands of a file, one chain per line. A # begins a comment.",
    example="moire --port twin run warm_up.txt",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file; - is the standard input.")
def run(call: Call, file: str) -> None:
    """All lines are parsed before the first command is carried out."""
    planned = []
    for number, text in enumerate(read_text(file).splitlines(), 1):
        try:
            planned += parse_line(text, call.options, call.session.description)
        except MoireError as error:
            raise UsageError(f"line {number} of {file}: {error}") from None
    for one in planned:
        call.session.carry_out(one)


@moire.command(
    "shell",
    help="Carry out commands from the keyboard until 'quit'. Drives stay on between them.",
    example="moire --port twin shell",
)
def shell(call: Call) -> None:
    """Lines from a pipe end at the first error; a person at a terminal may go on."""
    keyboard.run_shell(call)

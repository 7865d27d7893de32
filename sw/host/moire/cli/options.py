# SPDX-License-Identifier: Apache-2.0
"""The options that every command takes, and one that several share."""

from collections.abc import Collection
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import click
from click.core import ParameterSource

from moire.bus.protocol import ADDRESSES
from moire.bus.transport import BAUD, PARITIES
from moire.cli.values import (
    ADDRESS,
    AXIS,
    DURATION,
    FILE,
    POSITIVE,
    TEXT,
    WAITING_TIME,
    Name,
)
from moire.client.bus import ANSWER_S, TRIES

OF_THE_PORT = ("port", "machine_file", "baud", "parity", "patience", "tries", "record")
OF_THE_CALL = (*OF_THE_PORT, "json")
GIVEN = "moire.given"  # key in the meta data of a context


@dataclass(frozen=True)
class Options:
    """The values of the options of every command; the defaults hold where the user gives none."""

    port: str | None = None
    machine_file: str | None = None
    baud: int = BAUD
    parity: str = "auto"
    patience: Fraction | float = ANSWER_S  # s
    tries: int = TRIES
    record: str | None = None
    address: int = 1
    axis: int = 0
    json: bool = False


class Common(click.Option):
    """An option of every command. It may be given to `moire`, to a group or to the command."""

    def __init__(self, *names: str, **settings: Any) -> None:
        super().__init__(names, callback=remember, expose_value=False, **settings)
        self.settings = settings

    def without(self, taken: Collection[str]) -> "Common":
        """This option without the names that a command has for an option of its own."""
        left = [name for name in self.opts if name not in taken]
        return self if len(left) == len(self.opts) else Common(*left, **self.settings)


def remember(context: click.Context, option: click.Parameter, value: Any) -> None:
    """Keep what the user gave, so that the innermost command overrides the outer ones."""
    if context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE:
        context.meta.setdefault(GIVEN, {})[option.name] = value


COMMON = (
    Common(
        "--port",
        metavar="PORT",
        type=TEXT,
        help="The serial port (/dev/ttyUSB0, COM3, rfc2217://host:port, socket://host:port). "
        "'twin' is the simulated stage and 'twin:s2' another simulated machine. Without this "
        "option it is the port of the variable MOIRE_PORT, or of machine.toml.",
    ),
    Common(
        "--machine-file",
        metavar="FILE",
        type=FILE,
        help="The description of the machine: its port, and the names of its axes, which stand "
        "after the command (moire move x 1.5mm) or behind --axis. The default is the variable "
        "MOIRE_MACHINE_FILE, or machine.toml in this folder or in ~/.config/moire.",
    ),
    Common(
        "--baud",
        metavar="RATE",
        type=POSITIVE,
        help=f"The baud rate of the bus. The default is {BAUD}.",
    ),
    Common(
        "--parity",
        type=Name("parity", PARITIES),
        metavar=",".join(PARITIES),
        help="How the port sends the 9th bit. 'auto' takes mark parity where the port has it. "
        "'odd' reaches only the addresses 1 2 4 7 8 11 13 14. 'none' sends COBS packets in 8N1, "
        "which 'auto' takes for socket:// and pseudo terminals.",
    ),
    Common(
        "--patience",
        "--timeout",
        metavar="TIME",
        type=DURATION,
        help="How long to wait for an answer of a node before the request is repeated, in the time "
        f"of the machine: longer where a simulated one runs slowly. The default is "
        f"{1000 * ANSWER_S:g}ms.",
    ),
    Common(
        "--tries",
        metavar="N",
        type=POSITIVE,
        help=f"How often a request is sent before nobody answers. The default is {TRIES}.",
    ),
    Common(
        "--record",
        metavar="FILE",
        type=FILE,
        help="Write everything that is sent and received into FILE, for 'moire replay'.",
    ),
    Common(
        "--address",
        metavar="N",
        type=ADDRESS,
        help=f"The address of the node, {ADDRESSES[0]} to {ADDRESSES[-1]}. The default is 1.",
    ),
    Common("--axis", metavar="N", type=AXIS, help="The axis of the node. The default is 0."),
    Common(
        "--json",
        is_flag=True,
        help="Print one JSON object per line for each command, and errors as JSON too.",
    ),
)
FOR = click.option(
    "--for",
    "duration",
    type=WAITING_TIME,
    metavar="TIME",
    help="The command ends after this time. Without it Ctrl-C ends the command.",
)

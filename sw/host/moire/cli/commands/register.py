# SPDX-License-Identifier: Apache-2.0
"""The command register."""

import re
from typing import Any

import click

from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import TEXT
from moire.errors import OutOfRange, UnknownName
from moire.made.registers import FIELDS
from moire.nearest import unknown

NAMES = tuple(
    dict.fromkeys(f"{field.block}.{field.register}" for field in FIELDS if "r" in field.access)
)
OF_AN_AXIS = ("axis.", "feedback.", "actuator.")


@moire.command(
    "register",
    help="Read registers of the node, by name or by address.",
    example="moire --port twin register axis.position 0x400",
)
@click.argument(
    "registers",
    nargs=-1,
    type=TEXT,
    metavar="REGISTER",
    help="A name such as bus.frames_good, or an address such as 0x110. Without any the command "
    "lists the names.",
)
def register(call: Call, registers: tuple[str, ...]) -> None:
    """All names are checked before the first register is read."""
    if not registers:
        call.say({"names": NAMES}, "\n".join(NAMES))
        return
    addresses = {name: address_of(name) for name in registers}
    values: dict[str, Any] = {}
    rows, node = [], call.node
    for name, address in addresses.items():
        if address is not None:
            value = node.read_register(address)
            values[name] = value
            rows.append(f"{name} = 0x{value:08X} {value}")
        else:
            axis = call.axis.number if name.startswith(OF_AN_AXIS) else 0
            values[name] = node.read_named(name, axis)
            fields = [f"{field} = {value}" for field, value in values[name].items()]
            rows.append(f"{name}: {', '.join(fields)}")
    call.say_of_axis({"registers": values}, "\n".join(rows))


def address_of(name: str) -> int | None:
    """The address that a text is; None where it is the name of a register."""
    if not re.match(r"0[xX]|[0-9]", name):
        if name not in NAMES:
            raise UnknownName(unknown("register", name, NAMES, "'moire register'"))
        return None
    try:
        return int(name, 0)
    except ValueError:
        raise OutOfRange(
            f"'{name}' is no register address: write it like 0x400, or a name like axis.position"
        ) from None

# SPDX-License-Identifier: Apache-2.0
"""The commands about the description of the machine: machine show, check, apply, save."""

import click

from moire.cli.commands.params import differing
from moire.cli.files import write_text
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import FILE
from moire.client.axis import Axis
from moire.client.parameter_file import toml_lines
from moire.description import FILE as MACHINE_FILE
from moire.description import AxisDescription
from moire.errors import BadFile, BusError, MoireError

group = Group(
    "machine",
    help="Show the description of the machine (machine.toml), compare the nodes with it, set the "
    "parameters that it has, or write a new one.",
    example="moire machine show",
)
moire.add_command(group)


class Differs(MoireError):
    """The nodes have other parameters than the description."""


def described(call: Call) -> list[tuple[AxisDescription, Axis]]:
    """The named axes."""
    description = call.session.description
    if not description.axes:
        raise BadFile(
            f"no axis has a name: write a {MACHINE_FILE}, or let 'moire machine save' write it"
        )
    return [(one, call.bus.axis(*one.place)) for one in description.axes.values()]


@group.command("show", help="Show the names of the axes.", example="moire --port twin machine show")
def show(call: Call) -> None:
    """Opens no port."""
    description = call.session.description
    rows = [
        f"{one.name:<12}node {one.node} axis {one.axis}, in {one.unit}, "
        f"{len(one.parameters)} parameters{': ' if one.wiring else ''}{one.wiring}"
        for one in description.axes.values()
    ]
    head = f"{description.file or 'no file'}, port {description.port or 'none'}"
    text = f": {description.text}" if description.text else ""
    values = {
        "file": description.file,
        "port": description.port,
        "axes": {
            one.name: {"address": one.node, "axis": one.axis, "unit": one.unit}
            for one in description.axes.values()
        },
    }
    call.say(values, "\n".join([head + text, *(rows or ["no axis has a name"])]))


@group.command(
    "check",
    help="Compare the parameters of the axes with the description; exit code 1 if any differs.",
    example="moire --port twin machine check",
)
def check(call: Call) -> None:
    """Changes nothing."""
    found = [
        (one.name, value, there)
        for one, axis in described(call)
        for value, there in differing(axis, axis.check_parameters(one.parameters))
    ]
    rows = [
        f"{name:<12}{value.name:<20}{value.written():<20}described: {there}"
        for name, value, there in found
    ]
    values = [
        {"axis": name, "name": value.name, "value": value.written(), "described": there}
        for name, value, there in found
    ]
    call.say({"differences": values}, "\n".join(rows or ["all parameters are as described"]))
    if found:
        raise Differs(f"{len(found)} parameters differ: 'moire machine apply' sets them")


@group.command(
    "apply",
    help="Set the parameters of all axes as described. All are checked before the first is set.",
    example="moire --port twin machine apply",
)
def apply(call: Call) -> None:
    """For each power-up; 'params save-to-node' saves them in a node that has an EEPROM."""
    found = described(call)
    for one, axis in found:
        axis.check_parameters(one.parameters)
    counts = {one.name: len(axis.load_parameters(one.parameters)) for one, axis in found}
    rows = [f"{name:<12}{count} parameters set" for name, count in counts.items()]
    call.say({"set": counts}, "\n".join(rows))


@group.command(
    "save",
    help="Find the nodes and write a description with all axes, and with those of their parameters "
    "that differ from the defaults.",
    example=f"moire --port twin machine save {MACHINE_FILE}",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file to write.")
def save(call: Call, file: str) -> None:
    """Axes that have names keep them."""
    nodes = call.bus.find()
    if not nodes:
        raise BusError(0, "nobody answers: check power, wiring and baud rate")
    lines, count = [f'port = "{call.options.port}"'] if call.options.port else [], 0
    for node in nodes:
        for number in range(node.axes):
            known = call.session.description.at(node.address, number)
            is_named = known.name in call.session.description.axes
            name = known.name if is_named else f"axis_{node.address}_{number}"
            changed = [
                value
                for value in call.bus.axis(node.address, number).parameters().values()
                if not value.is_default
            ]
            lines += [
                "",
                f"[axes.{name}]",
                f"node = {node.address}",
                f"axis = {number}",
                f'unit = "{known.unit}"  # in which lengths are shown: mm, um or nm',
                f'wiring = "{known.wiring}"  # in words',
                "",
                f"[axes.{name}.parameters]",
                *toml_lines(changed),
            ]
            count += 1
    write_text(file, "\n".join(["# The description of a machine, for all clients.", *lines, ""]))
    call.say({"file": file, "axes": count}, f"{count} axes described in {file}")

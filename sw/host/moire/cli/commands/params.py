# SPDX-License-Identifier: Apache-2.0
"""The commands about the parameters of an axis: params list, get, set, save, load, diff,
save-to-node, saved-in-node, restore-defaults.
"""

from collections.abc import Mapping
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import click

from moire.cli.files import read_json, write_text
from moire.cli.parser import Group, UsageError, moire
from moire.cli.session import Call
from moire.cli.tables import add_value_commands
from moire.cli.values import FILE
from moire.client import parameter_file
from moire.client.axis import Axis
from moire.client.nonvolatile import SavedSettings
from moire.client.segments import Segments
from moire.client.values import ParameterValue
from moire.description import read_toml
from moire.errors import Refused
from moire.made.bus_tables import PARAMETERS

group = Group(
    "params",
    help="Show, set, save and load the parameters of an axis.",
    example="moire --port /dev/ttyUSB0 params set velocity 5mm/s -- params save stage.toml",
)
moire.add_command(group)


class Parameters:
    """The parameters of an axis by name, as add_value_commands() takes them."""

    def __init__(self, call: Call) -> None:
        self.get, self.set = call.axis.get_parameter, call.axis.set_parameter


add_value_commands(
    group,
    "parameter",
    tuple(PARAMETERS),
    Parameters,
    Call.say_of_axis,
    examples=(
        "moire --port twin params list",
        "moire --port twin params get velocity kp",
        "moire --port twin params set velocity 5mm/s",
    ),
    value_help="The value, with its unit if it has one: 5mm/s, 20ms, 20kHz, 0.5.",
)


@group.command(
    "save",
    help="Save all parameters, and the segment table if there is one, in a TOML file with comments "
    "or, if its name ends with .json, a JSON file.",
    example="moire --port twin params save stage.toml",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file to write.")
def save(call: Call, file: str) -> None:
    """For 'params load'."""
    axis = call.axis
    saved, points = axis.parameters(), segment_points(axis)
    is_json = file.endswith(".json")
    write_text(
        file,
        parameter_file.json_of(saved.values(), points)
        if is_json
        else parameter_file.toml_of(saved.values(), points, call.where),
    )
    call.say_of_axis(
        {"file": file, "count": len(saved)}, f"{amount(saved, points)} saved in {file}"
    )


@group.command(
    "load",
    help="Load the parameters from a file. All are checked before the first is written.",
    example="moire --port twin params load stage.toml",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file of 'params save'.")
def load(call: Call, file: str) -> None:
    """The file need not have all parameters."""
    texts, points = read_parameters(file)
    axis = call.axis
    if points:
        axis.check_parameters(texts)
        Segments(axis).write_points(points)
    loaded = axis.load_parameters(texts)
    call.say_of_axis(
        {"file": file, "count": len(loaded)}, f"{amount(loaded, points)} loaded from {file}"
    )


@group.command(
    "diff",
    help="Show the parameters that differ from their defaults, from those in a file, or from what "
    "they will be after the next power-up of the node.",
    example="moire --port /dev/ttyUSB0 params diff stage.toml -- params diff --saved",
)
@click.argument("file", type=FILE, metavar="FILE", required=False, help="A file of 'params save'.")
@click.option("--saved", is_flag=True, help="Compare with what the node has saved.")
def diff(call: Call, file: str | None, saved: bool) -> None:
    """Changes nothing."""
    axis = call.axis
    if saved and file is not None:
        raise UsageError("a file and --saved exclude each other: write one of them")
    if saved:
        other, name = "saved", "saved"
        found = differing(axis, SavedSettings(axis.node).parameters(axis.number))
    elif file is None:
        other, name = "default", "default"
        found = [
            (value, value.default_written)
            for value in axis.parameters().values()
            if not value.is_default
        ]
    else:
        other, name = "file", file
        found = differing(axis, axis.check_parameters(read_parameters(file)[0]))
    rows = [f"{value.name:<20}{value.written():<24}{name}: {there}" for value, there in found]
    same = f"{call.where}: all parameters " + (
        "have their defaults" if other == "default" else "agree"
    )
    call.say_of_axis(
        {
            "differences": [
                {"name": value.name, "value": value.written(), other: there}
                for value, there in found
            ]
        },
        "\n".join(rows) if rows else same,
    )


@group.command(
    "save-to-node",
    help="Save the parameters of all axes and the settings in the EEPROM of the node, for its next "
    "power-up.",
    example="moire --port /dev/ttyUSB0 params save-to-node",
)
def save_to_node(call: Call) -> None:
    """Returns when the EEPROM has been written."""
    say_saved(call, SavedSettings(call.node).save())


@group.command(
    "restore-defaults",
    help="Start with the default values at the next power-up of the node.",
    example="moire --port /dev/ttyUSB0 params restore-defaults",
)
def restore_defaults(call: Call) -> None:
    """What is in force now stays in force."""
    say_saved(call, SavedSettings(call.node).restore_defaults())


@group.command(
    "saved-in-node",
    help="Show whether the values saved in the node are in force, and why not.",
    example="moire --port /dev/ttyUSB0 params saved-in-node",
)
def saved_in_node(call: Call) -> None:
    """Since the power-up of the node."""
    say_saved(call, SavedSettings(call.node).state())


def say_saved(call: Call, state: Any) -> None:
    """Print what the node has saved."""
    call.say({**asdict(state), "words": state.words}, state.words)


def amount(parameters: dict[str, Any], points: list[int]) -> str:
    """What a file holds, in words."""
    return f"{len(parameters)} parameters{' and a segment table' if points else ''}"


def segment_points(axis: Axis) -> list[int]:
    """The points of the segment table; none if the node was built without one."""
    try:
        return list(Segments(axis).read_points())
    except Refused as refused:
        if refused.cause != "not_built":
            raise
        return []


def read_parameters(file: str) -> tuple[Mapping[str, str], list[int]]:
    """The parameters in a file as text, and the points of its segment table in counts."""
    return parameter_file.parsed(
        read_json(file) if file.endswith(".json") else read_toml(file), file
    )


def differing(axis: Axis, counts: Mapping[str, int]) -> list[tuple[ParameterValue, str]]:
    """The parameters of an axis that differ from these counts, and how those are written."""
    period_nm = axis.period_nm
    if "period" in counts:
        period_nm = Fraction(counts["period"], 1000)
    here = {name: axis.get_parameter(name) for name in counts}
    return [
        (here[name], axis.parameter_value(name, there, period_nm).written())
        for name, there in counts.items()
        if here[name].counts != there
    ]

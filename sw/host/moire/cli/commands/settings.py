# SPDX-License-Identifier: Apache-2.0
"""The commands about the settings of a station: settings list, get, set, save, load."""

from typing import Any

import click

from moire.cli.files import are_texts, read_json, write_json
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import FILE, TEXT, Name
from moire.client.settings import Settings
from moire.errors import BadFile
from moire.made.bus_tables import SETTINGS

NAME = Name("setting", SETTINGS, "settings list")

group = Group(
    "settings",
    help="Show, set, save and load the settings of a station (S4).",
    example="moire --port /dev/ttyUSB0 settings set turn_tolerance 0.3arcsec",
)
moire.add_command(group)


@group.command(
    "list",
    help="Show all settings with their values, units and ranges.",
    example="moire --port /dev/ttyUSB0 settings list",
)
def show_all(call: Call) -> None:
    """In the order of the tables."""
    settings = Settings(call.node)
    say_settings(call, [settings.get(name) for name in SETTINGS])


@group.command(
    "get",
    help="Show one or several settings.",
    example="moire --port /dev/ttyUSB0 settings get turn_share",
)
@click.argument(
    "names",
    nargs=-1,
    required=True,
    type=NAME,
    metavar="NAME",
    help="A name that 'moire settings list' shows.",
)
def get(call: Call, names: tuple[str, ...]) -> None:
    """In the order in which they are asked for."""
    settings = Settings(call.node)
    say_settings(call, [settings.get(name) for name in names])


@group.command(
    "set",
    help="Set one setting.",
    example="moire --port /dev/ttyUSB0 settings set turn_settle 200ms",
)
@click.argument("name", type=NAME, metavar="NAME", help="A name that 'moire settings list' shows.")
@click.argument(
    "value",
    type=TEXT,
    metavar="VALUE",
    help="The value, with its unit if it has one: 0.5arcsec, 20ms, frames.",
)
def put(call: Call, name: str, value: str) -> None:
    """The node reads it back."""
    say_settings(call, [Settings(call.node).set(name, value)])


@group.command(
    "save",
    help="Save all settings in a JSON file.",
    example="moire --port /dev/ttyUSB0 settings save station.json",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file to write.")
def save(call: Call, file: str) -> None:
    """For 'settings load'."""
    texts = Settings(call.node).save()
    write_json(file, texts)
    call.say({"file": file, "settings": len(texts)}, f"{len(texts)} settings in {file}")


@group.command(
    "load",
    help="Load the settings from a JSON file. All are checked before the first is written.",
    example="moire --port /dev/ttyUSB0 settings load station.json",
)
@click.argument("file", type=FILE, metavar="FILE", help="The file of 'settings save'.")
def load(call: Call, file: str) -> None:
    """The file need not have all settings."""
    texts = read_json(file)
    if not are_texts(texts):
        raise BadFile(f"{file} has no settings: it must be a JSON object of names and texts")
    loaded = Settings(call.node).load(texts)
    call.say({"file": file, "settings": len(loaded)}, f"{len(loaded)} settings from {file}")


def say_settings(call: Call, values: list[Any]) -> None:
    """Print settings with range and meaning."""
    reports = {
        value.name: {"value": value.value, "unit": value.unit, "written": value.written()}
        for value in values
    }
    rows = [
        f"{value.name:<20}{value.written():<16}{value.range_words:<32}{value.text}"
        for value in values
    ]
    call.say(reports, "\n".join(rows))

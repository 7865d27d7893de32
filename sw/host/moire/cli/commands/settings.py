# SPDX-License-Identifier: Apache-2.0
"""The commands about the settings of a station: settings list, get, set, save, load."""

import click

from moire.cli.files import are_texts, read_json, write_json
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.tables import add_value_commands
from moire.cli.values import FILE
from moire.client.settings import Settings
from moire.errors import BadFile
from moire.made.bus_tables import SETTINGS

group = Group(
    "settings",
    help="Show, set, save and load the settings of a station (S4).",
    example="moire --port /dev/ttyUSB0 settings set turn_tolerance 0.3arcsec",
)
moire.add_command(group)


add_value_commands(
    group,
    "setting",
    tuple(SETTINGS),
    lambda call: Settings(call.node),
    Call.say,
    examples=(
        "moire --port /dev/ttyUSB0 settings list",
        "moire --port /dev/ttyUSB0 settings get turn_share",
        "moire --port /dev/ttyUSB0 settings set turn_settle 200ms",
    ),
    value_help="The value, with its unit if it has one: 0.5arcsec, 20ms, frames.",
)


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
    call.say({"file": file, "count": len(texts)}, f"{len(texts)} settings saved in {file}")


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
        raise BadFile(
            f'the file {file} holds no settings: it must look like {{"turn_settle": "200ms"}}'
        )
    loaded = Settings(call.node).load(texts)
    call.say({"file": file, "count": len(loaded)}, f"{len(loaded)} settings loaded from {file}")

# SPDX-License-Identifier: Apache-2.0
"""The commands `moire turn …` (the table of a station) and `moire settings …`. The command line
adds them to its parser:

add_to(group, command)
"""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from moire import units
from moire.client.indexing_table import IndexingTable
from moire.client.settings import Settings
from moire.errors import BadFile, MoireError
from moire.made.bus_tables import SETTINGS


def angle(text):
    try:
        return units.parse_angle(text)
    except MoireError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_to(group, command):
    """group(name, text, example=): the sub-parsers of a new command; command(name, handler, text,
    example, under): one of them.
    """
    turn = group(
        "turn",
        "the table of a station (S4): turn it, look at it and its sensor",
        example="moire --port twin:s4 --address 2 turn to 0.5deg",
    )
    to = command(
        "to",
        do_to,
        "turn the table to an angle of its sensor, and wait",
        "moire --port /dev/ttyUSB0 turn to 12.5deg",
        turn,
    )
    to.add_argument(
        "angle", type=angle, metavar="ANGLE", help="with a unit: 12.5deg, 30arcmin, 0.5arcsec"
    )
    command(
        "status",
        do_status,
        "what the table, its sensor and its peer port do",
        "moire --port /dev/ttyUSB0 turn status",
        turn,
    )
    following = command(
        "next",
        do_next,
        "the station, of the program that 'job load' gave this sub-node, to which the next order in mode "
        "printed goes",
        "moire --port /dev/ttyUSB0 turn next 3",
        turn,
    )
    following.add_argument("station", type=int, metavar="N", help="from 0 on")

    settings = group(
        "settings",
        "settings of a station: list, get, set, save, load",
        example="moire --port /dev/ttyUSB0 settings set turn_tolerance 0.3arcsec",
    )
    command(
        "list",
        do_get,
        "all, with unit and range",
        "moire --port /dev/ttyUSB0 settings list",
        settings,
    ).set_defaults(names=[])
    get = command(
        "get", do_get, "one or some", "moire --port /dev/ttyUSB0 settings get turn_share", settings
    )
    get.add_argument(
        "names", nargs="+", metavar="NAME", choices=list(SETTINGS), help="see: settings list"
    )
    put = command(
        "set",
        do_set,
        "write one, with its unit",
        "moire --port /dev/ttyUSB0 settings set turn_settle 200ms",
        settings,
    )
    put.add_argument("name", metavar="NAME", choices=list(SETTINGS), help="see: settings list")
    put.add_argument(
        "value", metavar="VALUE", help="with a unit where it has one: 0.5arcsec, 20ms, frames"
    )
    save = command(
        "save",
        do_save,
        "all into a JSON file",
        "moire --port /dev/ttyUSB0 settings save station.json",
        settings,
    )
    save.add_argument("file", metavar="FILE")
    load = command(
        "load",
        do_load,
        "all that are in a JSON file; each is checked before the first is written",
        "moire --port /dev/ttyUSB0 settings load station.json",
        settings,
    )
    load.add_argument("file", metavar="FILE")


def table_of(session, options):
    return IndexingTable(session.bus.node(options.address))


def settings_of(session, options):
    return Settings(session.bus.node(options.address))


def said(value):
    return units.with_unit(units.ANGLE, value, 9)


def do_to(session, options):
    state = table_of(session, options).turn(options.angle)
    session.say(
        asdict(state),
        f"at {said(state.reading)}, {float(state.left):+.2f} arcsec left, {state.tries} tries",
    )


def do_status(session, options):
    table = table_of(session, options)
    state, sensor, peer = table.state(), table.sensor(), table.peer()
    session.say(
        {"table": asdict(state), "sensor": asdict(sensor), "peer": asdict(peer)},
        "\n".join(
            (
                f"table   {state.words}; target {said(state.target)}, read {said(state.reading)}; the last index: {state.ended_words}",
                f"sensor  {'dead' if sensor.dead else 'alive'}; {said(sensor.angle)}, {sensor.frames} frames, {sensor.wrong_crc} with a wrong CRC, "
                f"{sensor.broken} broken, {sensor.missed} missed",
                f"peer    {peer.words}; station {peer.station}, next {peer.next} of {peer.stations}; {peer.heard} heard, "
                f"{peer.garbage} not understood; {peer.ended_words}",
            )
        ),
    )


def do_next(session, options):
    table_of(session, options).next_station(options.station)
    session.say({"next": options.station}, f"next: station {options.station}")


def say_settings(session, values):
    session.say(
        {
            value.name: {"value": value.value, "unit": value.unit, "written": value.written()}
            for value in values
        },
        "\n".join(
            f"{value.name:<20}{value.written():<16}{value.range_words:<32}{value.text}"
            for value in values
        ),
    )


def do_get(session, options):
    settings = settings_of(session, options)
    say_settings(session, [settings.get(name) for name in options.names or SETTINGS])


def do_set(session, options):
    say_settings(session, [settings_of(session, options).set(options.name, options.value)])


def do_save(session, options):
    texts = settings_of(session, options).save()
    try:
        Path(options.file).write_text(json.dumps(texts, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadFile(f"{options.file} cannot be written: {error.strerror}") from None
    session.say(
        {"file": options.file, "settings": len(texts)}, f"{len(texts)} settings in {options.file}"
    )


def do_load(session, options):
    try:
        texts = json.loads(Path(options.file).read_text(encoding="utf-8"))
    except OSError as error:
        raise BadFile(f"{options.file} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise BadFile(f"{options.file} is no JSON: {error}") from None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise BadFile(f"{options.file} has no settings: a JSON object of names and texts is wanted")
    loaded = settings_of(session, options).load(texts)
    session.say(
        {"file": options.file, "settings": len(loaded)},
        f"{len(loaded)} settings from {options.file}",
    )

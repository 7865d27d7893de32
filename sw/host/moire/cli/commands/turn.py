# SPDX-License-Identifier: Apache-2.0
"""The commands about the indexing table of a station: turn to, status, next."""

from dataclasses import asdict
from fractions import Fraction

import click

from moire import units
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import ANGLE, WHOLE
from moire.client.indexing_table import IndexingTable

group = Group(
    "turn",
    help="Turn the indexing table of a station (S4), and show its state and its sensor.",
    example="moire --port twin:s4 --address 2 turn to 0.5deg",
)
moire.add_command(group)


@group.command(
    "to",
    help="Turn the table to an angle of its sensor, and wait until it is there.",
    example="moire --port /dev/ttyUSB0 turn to 12.5deg",
)
@click.argument(
    "angle",
    type=ANGLE,
    metavar="ANGLE",
    help="The angle with its unit, such as 12.5deg, 30arcmin or 0.5arcsec.",
)
def turn_to(call: Call, angle: Fraction) -> None:
    """The node repeats the motion until the sensor reads the angle."""
    state = IndexingTable(call.node).turn(angle)
    call.say(
        asdict(state),
        f"at {written(state.reading)}, {float(state.left):+.2f} arcsec left, {state.tries} tries",
    )


@group.command(
    "status",
    help="Show the state of the table, of its sensor and of its peer port.",
    example="moire --port /dev/ttyUSB0 turn status",
)
def status(call: Call) -> None:
    """One read-back of each."""
    table = IndexingTable(call.node)
    state, sensor, peer = table.state(), table.sensor(), table.peer()
    rows = (
        f"table   {state.words}; target {written(state.target)}, read {written(state.reading)}; "
        f"the last turn: {state.ended_words}",
        f"sensor  {'dead' if sensor.dead else 'alive'}; {written(sensor.angle)}, "
        f"{sensor.frames} frames, {sensor.wrong_crc} with a wrong CRC, {sensor.broken} broken, "
        f"{sensor.missed} missed",
        f"peer    {peer.words}; station {peer.station}, next {peer.next} of {peer.stations}; "
        f"{peer.heard} heard, {peer.garbage} not understood; {peer.ended_words}",
    )
    call.say(
        {"table": asdict(state), "sensor": asdict(sensor), "peer": asdict(peer)}, "\n".join(rows)
    )


@group.command(
    "next",
    help="Set the station to which the next order in legacy mode turns the table. The stations "
    "come from 'job load' to this sub-node.",
    example="moire --port /dev/ttyUSB0 turn next 3",
)
@click.argument(
    "station", type=WHOLE, metavar="N", help="The number of the station; the first is 0."
)
def next_station(call: Call, station: int) -> None:
    """Turns nothing itself."""
    IndexingTable(call.node).next_station(station)
    call.say({"next": station}, f"next: station {station}")


def written(arcsec: Fraction) -> str:
    """An angle with its unit."""
    return str(units.with_unit(units.ANGLE, arcsec, 9))

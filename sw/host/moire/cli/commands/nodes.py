# SPDX-License-Identifier: Apache-2.0
"""The commands about nodes and their bus: find, counters, baud."""

from dataclasses import asdict

import click

from moire.bus.protocol import ADDRESSES
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import ADDRESS, POSITIVE
from moire.client.records import Identity
from moire.errors import BusError


@moire.command(
    "find",
    help="Find the nodes on the bus.",
    example="moire --port /dev/ttyUSB0 find",
)
@click.argument(
    "addresses",
    nargs=-1,
    type=ADDRESS,
    metavar="ADDRESS",
    help="The addresses to ask. The default is all 15.",
)
@click.option(
    "--any-baud",
    is_flag=True,
    help="Try the usual baud rates, which takes up to half a minute, and stay at the rate at which "
    "a node answers.",
)
def find(call: Call, addresses: tuple[int, ...], any_baud: bool) -> None:
    """Ask every address who is there."""
    asked = list(addresses or ADDRESSES)
    found, baud = call.bus.find_baud(asked) if any_baud else (call.bus.find(asked), None)
    if not found:
        check = (
            "check power and wiring; no usual baud rate is left"
            if any_baud
            else "check power, wiring and baud rate, or try all with 'find --any-baud'"
        )
        raise BusError(0, f"nobody answers at the addresses {', '.join(map(str, asked))}: {check}")
    nodes = [{**asdict(node), "matches": node.matches} for node in found]
    rows = [identity_words(node) for node in found]
    if baud:
        rows.append(f"at {baud} baud: --baud {baud}")
    call.say({"nodes": nodes, "baud": baud}, "\n".join(rows))


def identity_words(node: Identity) -> str:
    """What a node is, in one line."""
    axes = "1 axis" if node.axes == 1 else f"{node.axes} axes"
    build = (
        "made from the same sources"
        if node.matches
        else "MADE FROM OTHER SOURCES than this host package"
    )
    return (
        f"node {node.address}: {axes}, clock {node.clk_hz / 1e6:g} MHz, "
        f"servo {node.tick_hz / 1e3:g} kHz, samples {node.sample_hz / 1e3:g} kHz, {build}"
    )


@moire.command(
    "counters",
    help="Show the counters of the bus, as the node and as this host count.",
    example="moire --port /dev/ttyUSB0 counters --json",
)
def counters(call: Call) -> None:
    """Frames and errors since the power-up of the node, and in this call."""
    node, host = call.node.counters(), asdict(call.bus.statistics)
    address = call.options.address
    rows = [
        f"node {address}:",
        *(f"  {name:<15} {value}" for name, value in node.items()),
        "seen by this host in this call:",
        *(f"  {name:<15} {value}" for name, value in host.items()),
    ]
    call.say({"address": address, "node": node, "host": host}, "\n".join(rows))


@moire.command(
    "baud",
    help="Use another baud rate until the end of this call.",
    example="moire --port /dev/ttyUSB0 baud 1000000 1 2 -- watch",
)
@click.argument(
    "rate",
    type=POSITIVE,
    metavar="RATE",
    help="9600 to 3000000, and at most an eighth of the clock of the nodes.",
)
@click.argument(
    "addresses",
    nargs=-1,
    required=True,
    type=ADDRESS,
    metavar="ADDRESS",
    help="The addresses of all nodes that any host talks to.",
)
def baud(call: Call, rate: int, addresses: tuple[int, ...]) -> None:
    """Change the rate of the nodes and of the port."""
    call.bus.set_baud(rate, list(addresses))
    call.say({"baud": rate, "addresses": addresses}, f"{rate} baud until the end of this call")

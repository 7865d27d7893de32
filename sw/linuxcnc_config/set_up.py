# SPDX-License-Identifier: Apache-2.0
"""Sets the real-time link of a node up for the driver, over the bus: which registers each packet
carries, the session, the rate of a serial line, the watchdog, and what the axes do without
set-points. The made HAL file runs it before it loads the driver.

    python -m linuxcnc_config.set_up --port /dev/ttyUSB0 --address 1 --axes 3 --session 4711
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

from linuxcnc_config.lists import READS, WRITES
from moire.bus.transport import open_bus
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.link import Captures, ProcessData
from moire.client.node import Node
from moire.errors import MoireError

WATCHDOG_S = 0.2
LATE_S = 5e-3  # for which an axis goes on without set-points, until it stops
LONGEST_SESSION = (1 << 24) - 1
CYCLE = 16  # a cycle of the node in the register link.bit_time, which has 20 bits
LEAST_BIT, LONGEST_BIT = 4 * CYCLE, (1 << 20) - 1


class Unfit(Exception):
    """One sentence that says why the node cannot be used."""


class Backlash(NamedTuple):
    """What Axis.set_backlash takes."""

    length: str
    velocity: str
    hysteresis: str
    motor_side: bool

    @classmethod
    def parsed(cls, text: str) -> tuple[int, Self]:
        """(number of the axis, its backlash) of `0:5um:2mm/s:0.5um:table`, or `motor`."""
        number, length, velocity, hysteresis, side = text.split(":")
        return int(number), cls(length, velocity, hysteresis, {"motor": True, "table": False}[side])


def bit_time_of(node: Node, baud: int) -> int:
    """The value of link.bit_time for a baud rate; Unfit if the node cannot have it. From 4 cycles a
    bit on the rounding is below 1 %, which a UART tolerates.
    """
    clk_hz = node.read_named("node.clk_hz")["value"]
    bit_time = round(CYCLE * clk_hz / baud)
    if not LEAST_BIT <= bit_time <= LONGEST_BIT:
        raise Unfit(
            f"a bit of {baud} baud takes {clk_hz / baud:.2f} cycles of the node, which has "
            f"{1e-6 * clk_hz:g} MHz: choose from {CYCLE * clk_hz // LONGEST_BIT + 1} to "
            f"{CYCLE * clk_hz // LEAST_BIT} baud"
        )
    return bit_time


def set_up(
    node: Node,
    axes: int,
    session: int,
    bit_time: int | None = None,
    watchdog_s: float = WATCHDOG_S,
    force: bool = False,
    backlash: Mapping[int, Backlash] = {},
    captures: Captures | None = None,
) -> None:
    """Sets the link of a node up and switches it on; Unfit if it has none, has another number of
    axes, or serves another host, unless it is to be taken from that by `force`. `backlash` is that
    of axes by their numbers, the others have none. `captures`: when the node reads what it replies.
    """
    state = node.read_named("link.state")
    if not state["built"]:
        raise Unfit("the node has no real-time link")
    found = node.read_named("node.build")["axes"]
    if found != axes:
        raise Unfit(f"the node has {found} axes, the configuration has {axes}")
    if state["on"] and not state["expired"] and not force:
        raise Unfit(f"another host runs the node, in session {state['session']}")
    for number in range(axes):
        if number in backlash:
            Axis(node, number).set_backlash(*backlash[number])
        elif node.read_named("axis.built", number)["backlash"]:
            node.write_named("feedback.backlash", number, value=0)
    clk_hz, tick = (node.read_named(f"node.{name}")["value"] for name in ("clk_hz", "tick_period"))
    node.write_named("node.late_limit", value=round(LATE_S * clk_hz / tick))
    ProcessData(WRITES, READS).set_up(
        node, bit_time, watchdog_s, session=session, captures=captures
    )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m linuxcnc_config.set_up",
        description="Sets the real-time link of a node up for LinuxCNC.",
    )
    parser.add_argument("--port", required=True, help="the port of the bus")
    parser.add_argument("--address", type=int, default=1, help="of the node on the bus")
    parser.add_argument("--axes", type=int, required=True, help="axes of the configuration")
    parser.add_argument("--session", type=int, required=True, help=f"1 to {LONGEST_SESSION}")
    parser.add_argument("--baud", type=int, help="of a serial link; without, as the node has it")
    parser.add_argument(
        "--watchdog",
        type=int,
        default=round(1e3 * WATCHDOG_S),
        metavar="MS",
        help="milliseconds without a packet after which the node switches its drives off "
        "(default %(default)s)",
    )
    parser.add_argument("--force", action="store_true", help="take the node from another host")
    parser.add_argument(
        "--backlash",
        action="append",
        default=[],
        metavar="AXIS:LENGTH:VELOCITY:HYSTERESIS:SIDE",
        help="backlash of an axis, how fast it is taken up, after which motion back, and the side "
        "on which the sensor is, motor or table: 0:5um:2mm/s:0.5um:table",
    )
    parser.add_argument(
        "--capture",
        metavar="US:PERIOD",
        help="microseconds before each packet at which the node reads its registers, and the "
        "period of the packets in microseconds: 200:1000; without, it reads them with the packet",
    )
    options = parser.parse_args(arguments)
    if options.baud is not None and options.baud < 1:
        parser.error("--baud must be above 0")
    captures = None
    if options.capture is not None:
        try:
            lead_us, period_us = map(float, options.capture.split(":"))
        except ValueError:
            parser.error("--capture needs two numbers, as 200:1000")
        captures = Captures(period_us * 1e-6, lead_us * 1e-6)
    try:
        backlash = dict(Backlash.parsed(text) for text in options.backlash)
    except (ValueError, KeyError):
        parser.error("--backlash needs five parts, as 0:5um:2mm/s:0.5um:table")
    try:
        with open_bus(options.port) as port:
            node = Bus(port).node(options.address)
            set_up(
                node,
                options.axes,
                options.session,
                bit_time=None if options.baud is None else bit_time_of(node, options.baud),
                watchdog_s=1e-3 * options.watchdog,
                force=options.force,
                backlash=backlash,
                captures=captures,
            )
    except (MoireError, Unfit) as why:
        print(f"moire: {options.port}: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

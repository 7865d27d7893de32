# SPDX-License-Identifier: Apache-2.0
"""Sets the real-time link of a node up for the driver, over the bus: which registers each packet
carries, the session, the watchdog. The made HAL file runs it before it loads the driver.

    python -m linuxcnc_config.set_up --port /dev/ttyUSB0 --address 1 --axes 3 --session 4711
"""

import argparse
import sys
from collections.abc import Sequence
from typing import Any, Protocol

from linuxcnc_config.lists import AXIS_READS, AXIS_WRITES, NODE_READS, NODE_WRITES
from moire.bus.transport import open_bus
from moire.client.bus import Bus
from moire.errors import MoireError
from moire.made.registers import BLOCKS, FIELDS

WORD_BYTES = 4
WATCHDOG_MS = 50
LONGEST_SESSION = (1 << 24) - 1


class Node(Protocol):
    """What is used of a node at the bus."""

    def read_named(self, name: str) -> dict[str, Any]: ...

    def write_named(self, name: str, **fields: Any) -> None: ...


class Unfit(Exception):
    """One sentence that says why the node cannot be used."""


def address(block: str, word: str, axis: int = 0) -> int:
    """The byte address of a register, or of the word NAME_low or NAME_high of a wide one."""
    offsets = {field.register: field.offset for field in FIELDS if field.block == block}
    register, _, half = word.rpartition("_")
    offset = offsets.get(word)
    if offset is None:
        offset = offsets[register] + (WORD_BYTES if half == "high" else 0)
    base, stride = BLOCKS[block]
    return base + axis * stride + offset


def lists(axes: int) -> tuple[list[int], list[int]]:
    """The addresses of the write list and of the read list."""
    writes = [address("axis", word, n) for n in range(axes) for word in AXIS_WRITES]
    reads = [address("axis", word, n) for n in range(axes) for word in AXIS_READS]
    return (
        writes + [address("node", word) for word in NODE_WRITES],
        [address("node", word) for word in NODE_READS] + reads,
    )


def set_up(
    node: Node, axes: int, session: int, watchdog_ms: int = WATCHDOG_MS, force: bool = False
) -> None:
    """Sets the link of a node up and switches it on; Unfit if it has none, has another number of
    axes, or serves another host, unless it is to be taken from that by `force`."""
    state = node.read_named("link.state")
    if not state["built"]:
        raise Unfit("the node has no real-time link")
    found = node.read_named("node.build")["axes"]
    if found != axes:
        raise Unfit(f"the node has {found} axes, the configuration has {axes}")
    if state["on"] and not state["expired"] and not force:
        raise Unfit(f"another host runs the node, in session {state['session']}")
    writes, reads = lists(axes)
    node.write_named("link.enable", value=0)
    for entry in range(max(len(writes), len(reads))):
        node.write_named("link.entry_number", value=entry)
        node.write_named(
            "link.entry",
            write=writes[entry] if entry < len(writes) else 0,
            read=reads[entry] if entry < len(reads) else 0,
        )
    node.write_named("link.lists", writes=len(writes), reads=len(reads))
    node.write_named("link.session", value=session)
    node.write_named("link.time_window", value=0)
    node.write_named("link.watchdog_time", value=watchdog_ms)
    node.write_named("link.enable", value=1)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m linuxcnc_config.set_up",
        description="Sets the real-time link of a node up for LinuxCNC.",
    )
    parser.add_argument("--port", required=True, help="the port of the bus")
    parser.add_argument("--address", type=int, default=1, help="of the node on the bus")
    parser.add_argument("--axes", type=int, required=True, help="axes of the configuration")
    parser.add_argument("--session", type=int, required=True, help=f"1 to {LONGEST_SESSION}")
    parser.add_argument("--force", action="store_true", help="take the node from another host")
    options = parser.parse_args(arguments)
    try:
        with open_bus(options.port) as port:
            node = Bus(port).node(options.address)
            set_up(node, options.axes, options.session, force=options.force)
    except (MoireError, Unfit) as why:
        print(f"moire: {options.port}: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

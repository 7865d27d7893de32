# SPDX-License-Identifier: Apache-2.0
"""Set-up of the real-time link of a node over its bus: lists of registers by their names.

    link = ProcessData(writes=["axis.control"], reads=["axis.position", "axis.faults"])
    session = link.set_up(node)
    request = session.request(time=0, values=[0])

`session` packs the requests and unpacks the replies; moire.bus.link describes it.
"""

import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from moire.bus.link import SESSION_BITS, Link, Reply
from moire.client.node import Node
from moire.errors import OutOfRange, Refused, UnknownName, with_more
from moire.made import link_tables as layout
from moire.made.registers import BLOCKS, FIELDS

WATCHDOG_S = 0.01
WORD_BITS = 32
LONGEST_WINDOW = (1 << 24) - 1  # cycles


@dataclass(frozen=True)
class Place:
    """A word of a list: the register, its axis, and its byte address in the register map."""

    register: str
    axis: int
    address: int
    high: bool = False  # the high word of a register of 64 bits


def places(registers: Iterable[str], axes: int) -> tuple[Place, ...]:
    """The words of a list. A register of an axis, such as "axis.position", is there once for each
    axis, one axis after the other; a register of 64 bits is two words, the low one first.
    """
    found: list[Place] = []
    for name in registers:
        block, _, register = name.partition(".")
        fields = [f for f in FIELDS if (f.block, f.register) == (block, register)]
        if not fields:
            raise UnknownName(f"there is no register '{name}': docs/registers.md lists them")
        wide = max(f.low + f.width for f in fields) > WORD_BITS
        for axis in range(axes if BLOCKS[block][1] else 1):
            address = fields[0].address(axis)
            found.append(Place(name, axis, address))
            if wide:
                found.append(Place(name, axis, address + 4, high=True))
    return tuple(found)


class ProcessData:
    """What a host exchanges with a node in each cycle: names of the registers that it writes, and
    of those that it reads, in this order. Strobes come last.
    """

    def __init__(self, writes: Sequence[str], reads: Sequence[str]) -> None:
        self.writes, self.reads = tuple(writes), tuple(reads)
        self.written: tuple[Place, ...] = ()
        self.read: tuple[Place, ...] = ()

    def set_up(
        self,
        node: Node,
        bit_time: int | None = None,
        watchdog_s: float = WATCHDOG_S,
        time_window: int = 0,
        session: int | None = None,
    ) -> Link:
        """Writes the lists and the settings over the bus, and switches the link on. Returns the
        session, whose number is drawn unless it is given.

        bit_time: 1/16 cycle of the node; as it is if None. watchdog_s: longest time without a good
        request. time_window: cycles, 0 for no check. Refused `not_built` without a link.
        """
        axes = node.read_named("node.build")["axes"]
        written, read = places(self.writes, axes), places(self.reads, axes)
        for what, words in (("write", written), ("read", read)):
            if len(words) > layout.MOST_VALUES:
                raise OutOfRange(
                    f"the {what} list has {len(words)} words: choose at most {layout.MOST_VALUES}"
                )
        if not 0 <= time_window <= LONGEST_WINDOW:
            raise OutOfRange(
                f"the time window is {time_window} cycles: choose from 0 to {LONGEST_WINDOW}"
            )
        number = secrets.randbits(SESSION_BITS) if session is None else session
        link = Link(number, len(written), len(read))
        self.switch_off(node)
        for n in range(max(len(written), len(read))):
            node.write_named("link.entry_number", value=n)
            node.write_named(
                "link.entry",
                write=written[n].address if n < len(written) else 0,
                read=read[n].address if n < len(read) else 0,
            )
        node.write_named("link.session", value=number)
        node.write_named("link.lists", writes=len(written), reads=len(read))
        node.write_named("link.time_window", value=time_window)
        node.write_named("link.watchdog_time", value=round(1000 * watchdog_s))
        if bit_time is not None:
            node.write_named("link.bit_time", value=bit_time)
        node.write_named("link.enable", value=1)
        self.written, self.read = written, read
        return link

    def counts(self, reply: Reply) -> dict[tuple[str, int], int]:
        """{(register, axis): its count} of a reply, unsigned; of a register of several fields, the
        whole word. For the lists of the last set-up.
        """
        found: dict[tuple[str, int], int] = {}
        for place, word in zip(self.read, reply.values, strict=True):
            name = place.register, place.axis
            found[name] = found.get(name, 0) | word << WORD_BITS * place.high
        return found

    @staticmethod
    def switch_off(node: Node) -> None:
        """Switches the link off: its watchdog ends, and its lists may be changed."""
        try:
            node.write_named("link.enable", value=0)
        except Refused as refused:
            if refused.cause != "not_built":
                raise
            raise with_more(refused, "it needs HAS_LINK of rtl/node.sv") from None

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
from moire.client.names import CAUSE_CODES, refusal
from moire.client.node import Node
from moire.errors import OutOfRange, Refused, UnknownName, with_more
from moire.made import link_tables as layout
from moire.made.registers import BLOCKS, FIELDS

WATCHDOG_S = 0.01
WORD_BITS = 32
LONGEST_WINDOW = (1 << 24) - 1  # cycles
PERIOD_S = 0.25e-3, 10e-3  # of requests, the shortest and the longest one that the PLL follows
PERIOD_CYCLES = 2048, (1 << 20) - 1  # the same in cycles of the node
MOST_LEAD = 3 / 8  # of a period


@dataclass(frozen=True)
class Captures:
    """That the PLL of the node follows the requests, which come every `period_s`, and captures the
    registers of the read list `lead_s` before it expects a request.
    """

    period_s: float
    lead_s: float

    def cycles(self, clk_hz: int) -> tuple[int, int]:
        """Period and lead in cycles of a node; OutOfRange if one is not possible."""
        low, high = PERIOD_S
        if not low <= self.period_s <= high:
            raise OutOfRange(
                f"the period of requests is {1e3 * self.period_s:g} ms: a PLL follows "
                f"{1e3 * low:g} to {1e3 * high:g} ms"
            )
        if not 0 <= self.lead_s <= MOST_LEAD * self.period_s:
            raise OutOfRange(
                f"the captures lead by {1e6 * self.lead_s:g} us: choose from 0 to "
                f"{1e6 * MOST_LEAD * self.period_s:g} us, 3/8 of the period"
            )
        period = round(self.period_s * clk_hz)
        least, most = PERIOD_CYCLES
        if not least <= period <= most:
            raise OutOfRange(
                f"the period of requests is {period} cycles of the node: a PLL follows "
                f"{least} to {most}"
            )
        return period, round(self.lead_s * clk_hz)


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
        captures: Captures | None = None,
    ) -> Link:
        """Writes the lists and the settings over the bus, and switches the link on. Returns the
        session, whose number is drawn unless it is given.

        bit_time: 1/16 cycle of the node; as it is if None. watchdog_s: longest time without a good
        request. time_window: cycles, 0 for no check. captures: None reads the registers when a
        request comes. Refused `not_built` without a link, or for captures without its PLL.
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
        period, lead = (0, 0) if captures is None else self.timing(node, captures)
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
        node.write_named("link.pll_period", value=period)
        node.write_named("link.capture_lead", value=lead)
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
    def timing(node: Node, captures: Captures) -> tuple[int, int]:
        """Period and lead of the captures in cycles of the node, which must have a PLL."""
        found = captures.cycles(node.read_named("node.clk_hz")["value"])
        if not node.read_named("link.pll_state")["built"]:
            refused = refusal(node.address, "captures", CAUSE_CODES["not_built"])
            raise with_more(refused, "it needs LINK_PLL of rtl/node.sv")
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

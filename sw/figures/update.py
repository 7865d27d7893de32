# SPDX-License-Identifier: Apache-2.0
"""Figure of the update of firmware over the bus: power cuts in the midst of it.

Host and firmware are the real ones: the client of the package moire talks to the compiled firmware,
whose flash and loader are the model of twin.compiled.flash_node. A quarter of the cuts come after a
random byte between node and flash, a quarter while a sector is being erased or a page programmed,
which leaves random bits there, a quarter while this is the entry of an image or its mark, on which
the choice of the image depends, and a quarter at the end, around the last bit of the mark. In a
third of the cases the power is cut again in the start that follows. The images are short and hold
random bytes, since the model does not execute them: it compares what the loader copied with what
was written.
"""

import random
from collections import Counter
from dataclasses import dataclass

from figures.common import Figure, Quick, bar, console
from moire.bus.transport import BAUD
from moire.client.bus import Bus
from moire.client.update import Firmware, update, update_state
from moire.errors import MoireError
from moire.made.bus_tables import PROTOCOL_CRC
from moire.made.registers import MAP_CRC
from twin.compiled.flash_node import START, FlashBus, FlashNode, SerialFlash

CUTS = 1000
ADDRESS = 1
SHORTEST, LONGEST = 33, 1500  # bytes of an image
FACTORY = b"factory firmware"
AGAIN = 1 / 3  # of the cuts are followed by another one during the next start
START_EXCHANGES = 4000  # of a start, at most: the second cut is among these
LAST_EXCHANGES = 30  # of an update: the mark is read back, and counts
COMPLETE_EVERY = 10  # cuts: then a further update has to succeed


@dataclass(frozen=True)
class Situation:
    """A flash as it is before an update, and the firmware that runs."""

    words: str
    content: bytes
    running: bytes


def bus_of(node: FlashNode) -> Bus:
    """A host that does not wait long for a node without power."""
    return Bus(FlashBus(node), tries=2, answer_s=0.02, random_source=random.Random(BAUD))


def firmware(source: random.Random) -> Firmware:
    """Random bytes in place of a program."""
    program = source.randbytes(source.randint(SHORTEST, LONGEST))
    return Firmware("counter", 8, "serial", 65536, MAP_CRC, PROTOCOL_CRC, program)


def situations(source: random.Random) -> list[Situation]:
    """Factory firmware alone, then with one and with two updates, and after a further one."""
    flash = SerialFlash(source, bytes(START) + FACTORY)
    found = [Situation("never updated", bytes(flash.content), FACTORY)]
    node = FlashNode(flash, ADDRESS)
    for words in ("updated once", "updated twice", "updated three times"):
        new = firmware(source)
        update(bus_of(node), ADDRESS, new)
        found.append(Situation(words, bytes(flash.content), new.program))
    return found


def powered(situation: Situation, source: random.Random) -> FlashNode:
    """A node in this situation, just switched on."""
    return FlashNode(SerialFlash(source, situation.content), ADDRESS)


def size(situation: Situation, new: Firmware, source: random.Random) -> tuple[int, int]:
    """Bytes between node and flash in a whole update, and its erasures and programmings."""
    node = powered(situation, source)
    node.flash.power_up()
    update(bus_of(node), ADDRESS, new)
    return node.flash.exchanges, node.flash.works


def answers(node: FlashNode, good: tuple[bytes, ...]) -> bool:
    """Whether the node answers, with one of these programs, and with a factory image that was not
    touched.
    """
    try:
        update_state(bus_of(node), ADDRESS)
    except MoireError:
        return False
    factory = node.flash.content[START:].startswith(FACTORY)
    return factory and node.runs.startswith(good)


def cut(situation: Situation, source: random.Random) -> tuple[bool, str]:
    """One update with a power cut: whether the node answers afterwards, and what it runs."""
    new = firmware(source)
    exchanges, works = size(situation, new, source)
    node = powered(situation, source)
    moment = source.randrange(4)
    if moment == 0:
        node.flash.power_up(cut_at=source.randint(1, exchanges))
    elif moment == 1:
        node.flash.power_up(cut_in=source.randint(1, works))
    elif moment == 2:
        node.flash.power_up(cut_in=source.choice([1, works - 1, works]))
    else:
        node.flash.power_up(cut_at=exchanges - source.randint(0, LAST_EXCHANGES))
    try:
        update(bus_of(node), ADDRESS, new)
    except MoireError:
        pass
    if source.random() < AGAIN:
        node.power_up(cut_at=source.randint(1, START_EXCHANGES))
    node.power_up()
    good = answers(node, (situation.running, new.program))
    runs = "the new one" if node.runs.startswith(new.program) else "the old one"
    if good and source.randrange(COMPLETE_EVERY) == 0:
        last = firmware(source)
        good = update(bus_of(node), ADDRESS, last).crc == last.crc
        node.power_up()
        good = good and answers(node, (last.program,))
    return good, runs


def update_bricked(seed: int = 1, cuts: int = CUTS) -> float:
    """Nodes that do not answer with the old or the new firmware after a power cut."""
    source = random.Random(seed)
    known = situations(source)
    bricked, runs = 0, Counter[str]()
    with bar("power cuts") as progress:
        for n in progress.track(range(cuts)):
            good, what = cut(known[n % len(known)], source)
            bricked += not good
            runs[what if good else "nothing"] += 1
    words = ", ".join(f"{count} run {what}" for what, count in sorted(runs.items()))
    console.print(f"of {cuts} nodes after a power cut {words}")
    return bricked


FIGURES = {
    "update_bricked": Figure(
        update_bricked,
        "",
        "nodes that no longer answer after one of 1000 power cuts during an update of their "
        "firmware over the bus, also in erasures and page programs, which then leave random bits; "
        "compiled firmware with a model of flash and loader",
        "0",
        Quick({"cuts": 12}, "12 power cuts"),
        digits=0,
    )
}

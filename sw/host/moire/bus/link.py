# SPDX-License-Identifier: Apache-2.0
"""The packets of the real-time link: docs/link.md has their layout.

`Link` makes the requests of a session and reads the replies to them. How the bytes reach the node
is the matter of a carrier.
"""

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from moire.errors import OutOfRange
from moire.made import link_tables as layout

WORD_BITS = 32
SESSION_BITS = 24
ADDRESS_BITS = 16
SPARE_WRITE = 1 << 31
COUNT_BITS = 8


@dataclass(frozen=True)
class Spare:
    """The access of a request to one more register: a read, or a write if it has a value."""

    address: int = 0  # bytes, in the register map
    value: int | None = None

    @property
    def words(self) -> tuple[int, int]:
        """The two words of the request."""
        if self.value is None:
            return self.address, 0
        return self.address | SPARE_WRITE, self.value


@dataclass(frozen=True)
class Reply:
    """What a node answers to a request."""

    sequence: int
    time: int  # cycles of the node, low word, before the first register was read
    values: tuple[int, ...]  # in the order of the read list
    spare: int  # value that the spare access read; without meaning after a write
    refused: dict[str, int]  # counts of refused packets by cause, which wrap at 256
    expired: bool  # the watchdog has expired


def sealed(words: Sequence[int]) -> bytes:
    """The bytes of a packet of these words, with its CRC-32."""
    content = struct.pack(f"<{len(words)}I", *words)
    return content + zlib.crc32(content).to_bytes(4, "little")


def words_of(packet: bytes) -> tuple[int, ...] | None:
    """The words of a packet without its CRC-32; None if it is damaged."""
    if len(packet) < 8 or len(packet) % 4:
        return None
    words = struct.unpack(f"<{len(packet) // 4}I", packet)
    return words[:-1] if words[-1] == zlib.crc32(packet[:-4]) else None


def checked(what: str, number: int, bits: int) -> int:
    """The number, if it fits."""
    if not 0 <= number < 1 << bits:
        raise OutOfRange(f"{what} is {number}: choose a number from 0 to {(1 << bits) - 1}")
    return number


class Link:
    """A session: the numbers that the host has chosen at set-up, and the last sequence."""

    def __init__(self, session: int, writes: int, reads: int):
        for what, entries in (("write", writes), ("read", reads)):
            if not 0 <= entries <= layout.MOST_VALUES:
                raise OutOfRange(
                    f"the {what} list has {entries} entries: choose at most {layout.MOST_VALUES}"
                )
        self.session = checked("session", session, SESSION_BITS)
        self.writes, self.reads = writes, reads
        self.sequence = 0  # of the last request

    def request(self, time: int, values: Sequence[int], spare: Spare | None = None) -> bytes:
        """The next request: `time` of the node in cycles when it will arrive, the values of the
        write list as words of 32 bits, and an access to one more register.
        """
        if len(values) != self.writes:
            raise OutOfRange(f"the write list has {self.writes} entries, not {len(values)} values")
        address, value = (spare or Spare()).words
        checked("address", address & ~SPARE_WRITE, ADDRESS_BITS)
        for word in (*values, value):
            checked("value", word, WORD_BITS)
        self.sequence = (self.sequence + 1) % (1 << WORD_BITS)
        identity = layout.KIND_REQUEST | self.session << 8
        moment = time % (1 << WORD_BITS)
        return sealed([identity, self.sequence, moment, *values, address, value])

    def reply(self, packet: bytes) -> Reply | None:
        """The reply to the last request; None if the packet is damaged, foreign, or old."""
        words = words_of(packet)
        if words is None:
            return None
        if len(words) != layout.REPLY_WORDS + self.reads + layout.REPLY_END_WORDS:
            return None
        identity, sequence, time, refused, state, *values, spare = words
        if identity != layout.KIND_REPLY | self.session << 8 or sequence != self.sequence:
            return None
        counts = refused | state << WORD_BITS
        names = [name for name, _ in layout.CAUSES]
        most = (1 << COUNT_BITS) - 1
        return Reply(
            sequence,
            time,
            tuple(values),
            spare,
            {name: counts >> COUNT_BITS * n & most for n, name in enumerate(names)},
            bool(counts >> COUNT_BITS * len(names) & 1),
        )

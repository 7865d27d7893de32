# SPDX-License-Identifier: Apache-2.0
"""The host's end of a relay's UART: requests as bytes, what the relay tells, and how a set is saved so that power may fail."""
import zlib
from dataclasses import dataclass

REQUEST, ANSWER = 0x21, 0x61
STATUS, CLEAR, BEGIN_SET, SET, FLASH = range(5)
LONGEST = 64
PAGE = 256


def frame(first, body):
    """(byte, ninth bit) of a frame."""
    row = bytes([first, len(body), *body])
    row += zlib.crc32(row).to_bytes(4, "little")
    return [(byte, int(n == 0)) for n, byte in enumerate(row)]


def body_of(words):
    """The body of a frame as it came, or None if it is broken."""
    row = bytes(byte for byte, _ in words)
    right = len(row) > 6 and row[0] == ANSWER and len(row) == row[1] + 6 and [ninth for _, ninth in words] == [1] + [0] * (len(row) - 1)
    return row[2:-4] if right and zlib.crc32(row[:-4]) == int.from_bytes(row[-4:], "little") else None


@dataclass
class Status:
    flags: int
    levels: int
    source: int
    identity: int
    position: int
    correction: int

    @classmethod
    def of(cls, body):
        low = lambda at: int.from_bytes(body[at:at + 4], "little")
        return cls(body[1], body[2], body[3], low(4), low(8), int.from_bytes(body[12:16], "little", signed=True))


def requests_of(image):
    """Bodies that bring a set into force."""
    parts = [image[n:n + LONGEST - 1] for n in range(0, len(image), LONGEST - 1)]
    return [bytes([SET if n else BEGIN_SET]) + part for n, part in enumerate(parts)]


def saves_of(image, address):
    """Bodies that write one copy at the start of a sector; the flash must be asked (0x05) until it is ready after each second one."""
    called = lambda command, at: bytes([FLASH, command]) + at.to_bytes(3, "big")
    rows = [called(0x20, address)]
    step = 32                                           # never over the border of a page
    rows += [called(0x02, address + n) + image[n:n + step] for n in range(0, len(image), step)]
    return [request for row in rows for request in (bytes([FLASH, 0x06]), row)]

# SPDX-License-Identifier: Apache-2.0
"""Packets for lines of plain 8N1 bytes: consistent overhead byte stuffing (COBS), and what Moire
puts into one.

A packet holds the bytes of one way of an exchange as they stand on the 9-bit line, without the
handshake: the first byte (command
byte, or ready byte of the reply), length, body, CRC-32. Stuffed, it has no zero; a zero ends it.
docs/protocol.md says more.
"""

from moire.bus.protocol import (
    ADDRESSES,
    CRC_LENGTH,
    FROM_NODE,
    LONGEST_BODY,
    TO_NODE,
    command_byte,
    frame,
    ready_byte,
)

LONGEST_RUN = 254  # bytes after one code byte
LONGEST_PACKET = 1 + 1 + LONGEST_BODY + CRC_LENGTH
LONGEST_STUFFED = LONGEST_PACKET + LONGEST_PACKET // LONGEST_RUN + 1


def stuff(content: bytes) -> bytes:
    """COBS, without the zero at its end."""
    out = bytearray()
    for part in content.split(b"\0"):
        while len(part) >= LONGEST_RUN:
            out += b"\xff" + part[:LONGEST_RUN]
            part = part[LONGEST_RUN:]
        out += bytes([len(part) + 1]) + part
    return bytes(out)


def unstuff(stuffed: bytes) -> bytes | None:
    """None when this is no COBS."""
    out, at = bytearray(), 0
    while at < len(stuffed):
        code = stuffed[at]
        run = stuffed[at + 1 : at + code]
        if code == 0 or len(run) != code - 1 or 0 in run:
            return None
        at += code
        out += run
        if code <= LONGEST_RUN and at < len(stuffed):
            out.append(0)
    return bytes(out)


def packet(first: int, body: bytes) -> bytes:
    """As it is sent: a zero in front ends whatever noise came before."""
    return sealed(bytes([first]) + frame(first, body))


def sealed(content: bytes) -> bytes:
    return b"\0" + stuff(content) + b"\0"


def body_of(content: bytes) -> bytes | None:
    """None unless this is a packet, whole and with the right CRC-32."""
    if (
        len(content) < 2
        or not 1 <= content[1] <= LONGEST_BODY
        or len(content) != 2 + content[1] + CRC_LENGTH
    ):
        return None
    body = content[2:-CRC_LENGTH]
    return body if content[1:] == frame(content[0], body) else None


def address_of(content: bytes, way: int) -> int | None:
    """The node that a request (TO_NODE) is for, or that a reply (FROM_NODE) is from; None when it
    is neither.
    """
    address = content[0] & 0xF if content else 0
    if address not in ADDRESSES:
        return None
    first = command_byte(address, TO_NODE) if way == TO_NODE else ready_byte(address, FROM_NODE)
    return address if content[0] == first else None


class PacketReader:
    """Cuts a stream of bytes into the contents of packets; what is no packet is dropped and
    counted.
    """

    def __init__(self):
        self.held, self.too_long = bytearray(), False
        self.dropped = 0

    def feed(self, arrived: bytes) -> list:
        contents = []
        for byte in arrived:
            if byte:
                self.too_long = self.too_long or len(self.held) >= LONGEST_STUFFED
                if not self.too_long:
                    self.held.append(byte)
                continue
            content = None if self.too_long else unstuff(bytes(self.held))
            if content:
                contents.append(content)
            elif self.held:
                self.dropped += 1
            self.held.clear()
            self.too_long = False
        return contents

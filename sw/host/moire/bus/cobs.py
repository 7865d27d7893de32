# SPDX-License-Identifier: Apache-2.0
"""Packets for connections of plain 8N1 bytes, by consistent overhead byte stuffing (COBS).

A packet holds the bytes of one direction of an exchange as they are on the 9-bit bus, without the
handshake: the first byte (command byte of the request, or ready byte of the reply), length, body,
CRC-32. Stuffed, it contains no zero; a zero ends it. docs/protocol.md has examples. The package
`cobs` does the stuffing.
"""

import struct

from cobs import cobs

from moire.bus.protocol import (
    ADDRESSES,
    CRC_LENGTH,
    FROM_NODE,
    READY,
    TO_NODE,
    command_byte,
    frame,
    ready_byte,
)
from moire.made.bus_tables import LONGEST_BODY

LONGEST_PACKET = 1 + 1 + LONGEST_BODY + CRC_LENGTH
LONGEST_STUFFED = LONGEST_PACKET + 1  # a packet is shorter than 254 bytes: one byte more

# address 0 is the server itself: a request for it, and its reply, whose body ends with the speed of
# a simulated machine in thousandths of a simulated second per second, 0 where there is none; or its
# message that no node has identified itself at an address
TO_SERVER, FROM_SERVER = TO_NODE << 4, READY | FROM_NODE << 4
SPEED_OF_SERVER, NOBODY, SPEED_FIELD, THOUSAND = 0, 1, struct.Struct("<I"), 1000


def unstuff(stuffed: bytes) -> bytes | None:
    """The content of a stuffed packet without its final zero; None when it is no COBS."""
    try:
        return bytes(cobs.decode(stuffed))
    except cobs.DecodeError:
        return None


def packet(first: int, body: bytes) -> bytes:
    """The bytes to send for a body; `first` is the command byte or the ready byte."""
    return sealed(bytes([first]) + frame(first, body))


def sealed(content: bytes) -> bytes:
    """The bytes to send for a content: a zero in front ends whatever noise came before."""
    return b"\0" + bytes(cobs.encode(content)) + b"\0"


def body_of(content: bytes) -> bytes | None:
    """The body of a packet; None unless it is complete and its CRC-32 is right."""
    if (
        len(content) < 2
        or not 1 <= content[1] <= LONGEST_BODY
        or len(content) != 2 + content[1] + CRC_LENGTH
    ):
        return None
    body = content[2:-CRC_LENGTH]
    return body if content[1:] == frame(content[0], body) else None


def address_of(content: bytes, direction: int) -> int | None:
    """The node that a request (TO_NODE) is for, or that a reply (FROM_NODE) is from.

    None when the packet is neither.
    """
    address = content[0] & 0xF if content else 0
    if address not in ADDRESSES:
        return None
    request = direction == TO_NODE
    first = command_byte(address, TO_NODE) if request else ready_byte(address, FROM_NODE)
    return address if content[0] == first else None


def speed_request(sequence: int) -> bytes:
    """The packet that asks a server how fast its simulated machine runs."""
    return packet(TO_SERVER, bytes([sequence, SPEED_OF_SERVER]))


def speed_reply(content: bytes, speed: float | None) -> bytes | None:
    """The packet that answers this content; None if it is no such request."""
    body = body_of(content)
    if content[0] != TO_SERVER or body is None or body[1:] != bytes([SPEED_OF_SERVER]):
        return None
    most = 256**SPEED_FIELD.size - 1
    counts = min(round(THOUSAND * speed), most) if speed is not None else 0
    return packet(FROM_SERVER, body + b"\0" + SPEED_FIELD.pack(counts))


def speed_in(content: bytes) -> float | None:
    """The speed in a reply of a server; None without one."""
    body = body_of(content)
    if body is None or len(body) != 3 + SPEED_FIELD.size:
        return None
    return SPEED_FIELD.unpack(body[3:])[0] / THOUSAND or None


def nobody(sequence: int, address: int) -> bytes:
    """The packet that says that no node has identified itself at an address."""
    return packet(FROM_SERVER, bytes([sequence, NOBODY, address]))


def nobody_at(content: bytes) -> int | None:
    """The address in such a packet of a server; None if it is another one."""
    body = body_of(content)
    is_it = content[0] == FROM_SERVER and body is not None and len(body) == 3 and body[1] == NOBODY
    return body[2] if body and is_it else None


class PacketReader:
    """Cuts a stream of bytes into the contents of packets.

    `dropped` counts the pieces between two zeros that are no packet. `longest` is the most stuffed
    bytes of a packet.
    """

    def __init__(self, longest: int = LONGEST_STUFFED) -> None:
        self.held, self.too_long, self.longest = bytearray(), False, longest
        self.dropped = 0

    def feed(self, arrived: bytes) -> list[bytes]:
        """Takes the bytes that arrived; returns the contents of the packets that they complete."""
        contents = []
        for byte in arrived:
            if byte:
                self.too_long = self.too_long or len(self.held) >= self.longest
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

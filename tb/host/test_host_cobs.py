# SPDX-License-Identifier: Apache-2.0
"""moire.bus.cobs: stuffing as in the published examples, packets, and a reader
that recovers from any noise.
"""

import random
import zlib
from pathlib import Path

import pytest

from moire.bus import cobs
from moire.bus.protocol import CRC_LENGTH, FROM_NODE, TO_NODE, frame
from moire.made.bus_tables import LONGEST_BODY
from tb.bench import seed

SEED = seed()
BODY = b"\x07\x03\x00\x01"


@pytest.mark.parametrize(
    "plain, stuffed",
    [  # Cheshire and Baker, and the edges of a run
        (b"", "01"),
        (b"\0", "0101"),
        (b"\0\0", "010101"),
        (b"\0\x11\0", "01021101"),
        (b"\x11\x22\0\x33", "0311220233"),
        (b"\x11\0\0\0", "0211010101"),
        (bytes(range(1, 254)), "fe" + bytes(range(1, 254)).hex()),
        (bytes(range(1, 255)) + b"\xff", "ff" + bytes(range(1, 255)).hex() + "02ff"),
    ],
)
def test_stuffing_is_as_in_the_cobs_paper(plain, stuffed):
    assert cobs.sealed(plain).hex() == f"00{stuffed}00"
    assert cobs.unstuff(bytes.fromhex(stuffed)) == plain


def test_stuffed_bytes_have_no_zero_and_can_be_unstuffed():
    source = random.Random(SEED)
    for length in [*range(20), *range(250, 260), 600]:
        plain = bytes(source.choice([0, 1, 255, source.randrange(256)]) for _ in range(length))
        stuffed = cobs.sealed(plain)[1:-1]
        assert 0 not in stuffed and cobs.unstuff(stuffed) == plain


def test_the_packet_of_the_protocol_page():
    page = (Path(__file__).resolve().parents[2] / "docs" / "protocol.md").read_text()
    assert cobs.packet(0x21, BODY).hex(" ") == "00 05 21 04 07 03 06 01 86 67 24 60 00"
    for first, body, sender in ((0x21, BODY, "client  "), (0x51, bytes([7, 3, 0]), "node    ")):
        assert sender + cobs.packet(first, body).hex(" ").upper() in page
    assert cobs.PacketReader().feed(cobs.packet(0x21, BODY)) == [bytes([0x21]) + frame(0x21, BODY)]


def test_only_a_correct_packet_has_a_body_and_a_node():
    content = bytes([0x2B]) + frame(0x2B, BODY)
    assert cobs.body_of(content) == BODY
    assert cobs.address_of(content, TO_NODE) == 11 and cobs.address_of(content, FROM_NODE) is None
    assert cobs.address_of(b"\x5b", FROM_NODE) == 11
    assert [cobs.address_of(wrong, TO_NODE) for wrong in (b"", b"\x20", b"\x1b", b"\x6b")] == [
        None
    ] * 4
    for bit in range(8 * len(content)):
        spoilt = bytearray(content)
        spoilt[bit // 8] ^= 1 << bit % 8
        assert cobs.body_of(bytes(spoilt)) is None
    assert all(cobs.body_of(content[:length]) is None for length in range(len(content)))


def test_the_shortest_and_the_longest_body_are_read_and_no_empty_or_longer_one():
    for length, good in ((0, False), (1, True), (LONGEST_BODY, True), (LONGEST_BODY + 1, False)):
        body = bytes(length)
        content = bytes([0x21, length]) + body
        content += zlib.crc32(content).to_bytes(CRC_LENGTH, "little")
        assert cobs.body_of(content) == (body if good else None), length
    longest = bytes([0x21]) + frame(0x21, bytes(LONGEST_BODY))
    assert len(longest) == cobs.LONGEST_PACKET
    assert len(cobs.sealed(longest)) - 2 <= cobs.LONGEST_STUFFED == cobs.LONGEST_PACKET + 1


def speed_body(speed, asked=bytes([9, 0])):
    """The body of the answer of a server whose machine runs at this speed."""
    [request] = cobs.PacketReader().feed(cobs.speed_request(asked[0]))
    assert request == b"\x20" + frame(0x20, asked)
    [reply] = cobs.PacketReader().feed(cobs.speed_reply(request, speed))
    assert reply[0] == 0x50
    return cobs.body_of(reply), reply


@pytest.mark.parametrize(
    "speed, counts, back",
    [(0.25, 250, 0.25), (None, 0, None), (1.0004, 1000, 1.0), (1e9, 2**32 - 1, 4294967.295)],
)
def test_a_server_tells_the_speed_of_its_machine_in_thousandths(speed, counts, back):
    body, reply = speed_body(speed)
    assert body == b"\x09\0\0" + counts.to_bytes(4, "little")
    assert cobs.speed_in(reply) == back


def test_what_is_no_request_to_a_server_gets_no_answer_and_what_is_no_answer_has_no_speed():
    def content(first, body):
        return bytes([first]) + frame(first, body)

    request = content(0x20, b"\x09\0")
    assert cobs.speed_reply(request, 1.0)
    others = [content(0x21, b"\x09\0"), content(0x10, b"\x09\0"), content(0x20, b"\x09\1")]
    for wrong in (*others, content(0x20, b"\x09"), content(0x20, b"\x09\0\0"), request[:-1]):
        assert cobs.speed_reply(wrong, 1.0) is None
    _, reply = speed_body(1.0)
    assert cobs.speed_in(reply[:-1]) is None
    for length in (1, 2, 3, 4, 6, 8, 10, 11):
        assert cobs.speed_in(content(0x50, bytes([1]) * length)) is None


def test_a_reader_takes_bytes_one_by_one_or_in_one_piece():
    stream = cobs.packet(0x21, BODY) + cobs.packet(0x22, b"\0" * 64)
    reader = cobs.PacketReader()
    assert sum((reader.feed(bytes([byte])) for byte in stream), []) == cobs.PacketReader().feed(
        stream
    )
    assert reader.dropped == 0


def test_the_packet_after_any_noise_is_read():
    source = random.Random(SEED)
    for _ in range(2000):
        reader = cobs.PacketReader()
        noise = source.randbytes(source.randrange(200))
        assert reader.feed(noise + cobs.packet(0x21, BODY))[-1] == bytes([0x21]) + frame(
            0x21, BODY
        ), noise.hex()
        assert len(reader.held) == 0


def test_a_packet_that_is_too_long_is_dropped_and_counted_and_not_stored():
    reader = cobs.PacketReader()
    assert reader.feed(b"\x01" * 100_000) == [] and len(reader.held) <= cobs.LONGEST_STUFFED
    assert reader.feed(b"\0") == [] and reader.dropped == 1
    assert reader.feed(b"\x05\x01\0") == [] and reader.dropped == 2
    longest = bytes([0x21]) + frame(0x21, bytes(range(1, 65)))
    assert reader.feed(cobs.sealed(longest)) == [longest]


def test_the_server_says_at_which_address_nobody_is():
    [message] = cobs.PacketReader().feed(cobs.nobody(7, 5))
    assert message[0] == cobs.FROM_SERVER and cobs.nobody_at(message) == 5
    assert cobs.body_of(message) == bytes([7, 1, 5])
    assert cobs.speed_in(message) is None
    [request] = cobs.PacketReader().feed(cobs.speed_request(1))
    for other in (cobs.speed_reply(request, 1.0), cobs.packet(0x55, b"\7\1\5")):
        assert cobs.nobody_at(*cobs.PacketReader().feed(other)) is None
    assert cobs.nobody_at(message[:-1]) is None
    [unknown] = cobs.PacketReader().feed(cobs.packet(cobs.FROM_SERVER, bytes([7, 2, 5])))
    assert cobs.nobody_at(unknown) is None

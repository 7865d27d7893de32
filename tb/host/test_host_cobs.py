# SPDX-License-Identifier: Apache-2.0
"""moire.bus.cobs: stuffing as in the published examples, packets, and a reader
that recovers from any noise.
"""

import random
from pathlib import Path

import pytest

from moire.bus import cobs
from moire.bus.protocol import FROM_NODE, TO_NODE, frame
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
    longest = bytes([0x21]) + frame(0x21, bytes(range(1, 65)))
    assert reader.feed(cobs.sealed(longest)) == [longest]

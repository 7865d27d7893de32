# SPDX-License-Identifier: Apache-2.0
"""moire.bus.rfc2217: the bytes of RFC 854 and RFC 2217; test_host_gateway has the client of
pyserial against it.
"""

import random

import pytest

from moire.bus import rfc2217
from tb.bench import seed

SEED = seed()
IAC, SB, SE, COM_PORT = 0xFF, 0xFA, 0xF0, 44


def subnegotiation(command, *value):
    return bytes([IAC, SB, COM_PORT, command, *value, IAC, SE])


def server():
    return rfc2217.Server(115200)


@pytest.mark.parametrize(
    "code, parity, ninths",
    [(1, "N", (0, 0)), (2, "O", (1, 0)), (3, "E", (0, 1)), (4, "M", (1, 1)), (5, "S", (0, 0))],
)
def test_each_parity_makes_its_ninth_bit(code, parity, ninths):
    port = server()
    characters = port.feed(subnegotiation(3, code) + b"\x03\x01")
    assert [(character.byte, character.parity) for character in characters] == [
        (3, parity),
        (1, parity),
    ]
    assert tuple(character.ninth for character in characters) == ninths
    assert port.take_answers() == subnegotiation(103, code) and port.take_answers() == b""


def test_characters_keep_the_parity_that_was_in_force_when_they_were_sent():
    characters = server().feed(
        subnegotiation(3, 4)
        + b"\x21"
        + subnegotiation(3, 5)
        + b"\x04\x07"
        + subnegotiation(3, 4)
        + b"\x11"
    )
    assert [(character.byte, character.ninth) for character in characters] == [
        (0x21, 1),
        (4, 0),
        (7, 0),
        (0x11, 1),
    ]


def test_ff_is_doubled_both_ways():
    assert [character.byte for character in server().feed(b"\x01\xff\xff\x02")] == [1, 255, 2]
    assert rfc2217.escaped(b"\x01\xff\x02") == b"\x01\xff\xff\x02"


def test_settings_are_answered_and_zero_only_reads():
    port = server()
    port.feed(
        subnegotiation(1, 0, 0, 0, 0)
        + subnegotiation(2, 0)
        + subnegotiation(1, 0, 0, 0x25, 0x80)
        + subnegotiation(1, 0, 0, 0, 0)
        + subnegotiation(2, 8)
        + subnegotiation(4, 2)
    )
    assert port.take_answers() == (
        subnegotiation(101, 0, 1, 0xC2, 0)
        + subnegotiation(102, 8)
        + subnegotiation(101, 0, 0, 0x25, 0x80) * 2
        + subnegotiation(102, 8)
        + subnegotiation(104, 2)
    )
    assert port.baud == 9600


def test_a_setting_with_255_in_it_is_accepted_and_answered_doubled():
    port = server()
    port.feed(bytes([IAC, SB, COM_PORT, 1, 0, 0, 0xFF, 0xFF, 0, IAC, SE]))
    assert port.baud == 0xFF00 and port.take_answers() == bytes(
        [IAC, SB, COM_PORT, 101, 0, 0, 0xFF, 0xFF, 0, IAC, SE]
    )


def test_options_are_agreed_once_and_unknown_ones_declined():
    port = server()
    port.feed(bytes([IAC, 0xFB, 44, IAC, 0xFD, 44, IAC, 0xFB, 0, IAC, 0xFD, 1, IAC, 0xFB, 99]) * 3)
    assert port.take_answers() == bytes(
        [IAC, 0xFD, 44, IAC, 0xFB, 44, IAC, 0xFD, 0, IAC, 0xFC, 1, IAC, 0xFE, 99]
    )


def test_a_purge_and_controls_are_answered_and_the_modem_state_reported():
    port = server()
    port.feed(
        subnegotiation(12, 3)
        + subnegotiation(5, 8)
        + subnegotiation(11, 255, 255)
        + subnegotiation(99, 1)
    )
    assert port.take_answers() == subnegotiation(112, 3) + subnegotiation(105, 8) + bytes(
        [IAC, SB, COM_PORT, 111, 255, 255, IAC, SE]
    ) + subnegotiation(107, 0xB0)


def test_bytes_may_arrive_in_pieces():
    stream = subnegotiation(3, 4) + b"\x21\xff\xff" + subnegotiation(3, 5) + b"\x04"
    at_once, pieces = server(), server()
    assert at_once.feed(stream) == sum((pieces.feed(bytes([byte])) for byte in stream), [])
    assert at_once.take_answers() == pieces.take_answers()


def test_random_bytes_are_neither_stored_nor_stop_the_server():
    source = random.Random(SEED)
    port = server()
    port.feed(bytes([IAC, SB]) + b"\x2c" * 100_000)
    assert len(port.option) <= rfc2217.LONGEST_OPTION + 1
    port.feed(bytes([IAC, SE]))
    for _ in range(3000):
        port.feed(
            bytes(
                source.choice([IAC, SB, SE, COM_PORT, 3, source.randrange(256)]) for _ in range(30)
            )
        )
    port.feed(bytes([IAC, SE, IAC, SE]))
    port.take_answers()
    assert [
        character.parity for character in port.feed(bytes([0]) + subnegotiation(3, 4) + b"\x55")
    ][-1] == "M"

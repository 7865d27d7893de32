# SPDX-License-Identifier: Apache-2.0
"""The packets of the C driver against those of the host package, byte for byte."""

import ctypes
import random

from moire.bus.link import Link, Spare, sealed
from moire.made import link_tables as layout
from tb.bench import seed
from tb.linuxcnc.compiled import LONGEST, Reply, Session, driver

WORD = 1 << 32


def words(values):
    return (ctypes.c_uint32 * len(values))(*values)


def random_words(dice, count):
    return [dice.randrange(WORD) for _ in range(count)]


def a_reply(dice, link):
    """A good reply to the last request of a session: (packet, values, counts)."""
    values, counts = random_words(dice, link.reads), [dice.randrange(256) for _ in layout.CAUSES]
    state = sum(count << 8 * n for n, count in enumerate(counts)) | dice.randrange(2) << 48
    identity = layout.KIND_REPLY | link.session << 8
    content = [identity, link.sequence, 77, state % WORD, state >> 32, *values, 0xABCD]
    return sealed(content), values, counts


def taken(session, packet):
    """What the driver reads from a packet: a Reply, or None."""
    found = Reply()
    good = driver().packet_reply(
        ctypes.byref(session), packet, ctypes.c_size_t(len(packet)), ctypes.byref(found)
    )
    return found if good else None


def test_requests_are_those_of_the_host_package():
    dice = random.Random(seed())
    packet = ctypes.create_string_buffer(LONGEST)
    for _ in range(300):
        writes, reads = (dice.randrange(layout.MOST_VALUES + 1) for _ in range(2))
        number = dice.randrange(1 << 24)
        link, session = Link(number, writes, reads), Session(number, writes, reads, 0)
        for _ in range(3):
            time, values = dice.randrange(WORD), random_words(dice, writes)
            spare = Spare(dice.randrange(1 << 16), dice.choice([None, dice.randrange(WORD)]))
            length = driver().packet_request(
                ctypes.byref(session), time, words(values), *spare.words, packet
            )
            assert packet.raw[:length] == link.request(time, values, spare)


def test_the_sequence_wraps():
    session, link = Session(5, 0, 0, WORD - 1), Link(5, 0, 0)
    link.sequence = WORD - 1
    packet = ctypes.create_string_buffer(LONGEST)
    length = driver().packet_request(ctypes.byref(session), 0, words([]), 0, 0, packet)
    assert packet.raw[:length] == link.request(0, []) and session.sequence == 0


def test_good_replies_are_read():
    dice = random.Random(seed())
    for _ in range(300):
        link = Link(dice.randrange(1 << 24), 0, dice.randrange(layout.MOST_VALUES + 1))
        link.sequence = dice.randrange(WORD)
        session = Session(link.session, 0, link.reads, link.sequence)
        packet, values, counts = a_reply(dice, link)
        found = taken(session, packet)
        assert found and found.time == 77 and found.spare == 0xABCD
        assert found.values[: link.reads] == values
        assert list(found.refused) == counts
        assert link.reply(packet).values == tuple(values)
        assert driver().packet_reply_length(ctypes.byref(session)) == len(packet)


def test_damaged_replies_are_not_read():
    dice = random.Random(seed())
    link = Link(99, 0, 7)
    session = Session(99, 0, 7, 0)
    for _ in range(2000):
        packet = bytearray(a_reply(dice, link)[0])
        for _ in range(dice.randint(1, 3)):
            bit = dice.randrange(8 * len(packet))
            packet[bit // 8] ^= 1 << bit % 8
        assert (taken(session, bytes(packet)) is None) == (link.reply(bytes(packet)) is None)


def test_truncated_lengthened_and_empty_replies_are_not_read():
    link, session = Link(99, 0, 7), Session(99, 0, 7, 0)
    packet = a_reply(random.Random(seed()), link)[0]
    assert taken(session, packet)
    assert not any(taken(session, packet[:length]) for length in range(len(packet)))
    assert not taken(session, packet + bytes(4)) and not taken(session, bytes(LONGEST))


def test_replayed_and_foreign_replies_are_not_read():
    dice = random.Random(seed())
    link, session = Link(99, 0, 7), Session(99, 0, 7, 0)
    old = a_reply(dice, link)[0]
    link.request(0, [])
    session.sequence = link.sequence
    assert taken(session, a_reply(dice, link)[0]) and not taken(session, old)
    other = Link(98, 0, 7)
    other.sequence = link.sequence
    assert not taken(session, a_reply(dice, other)[0])
    assert not taken(session, link.request(0, []))

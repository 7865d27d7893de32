# SPDX-License-Identifier: Apache-2.0
"""The serial line between two nodes: what is sent arrives, with garbage among it on request."""

import random

import numpy

from twin import PeerLineBench

BIT = 104  # cycles; 9615 baud at 1 MHz


def levels_of(data, gap=3):
    cells = []
    for byte in data:
        cells += [0, *(byte >> bit & 1 for bit in range(8)), *[1] * (1 + gap)]
    return numpy.repeat(cells, BIT)


def idle(cells):
    return numpy.ones(cells * BIT)


def test_what_is_sent_arrives_untouched():
    line = PeerLineBench()
    data = bytes(random.randrange(256) for _ in range(50))
    sent = levels_of(data, gap=0)
    assert (line.pass_levels(sent) == sent).all()
    line.pass_levels(idle(2))
    assert line.take_received() == data and line.take_received() == b"" and line.framing_errors == 0


def test_a_character_at_a_wrong_rate_is_a_framing_error():
    line = PeerLineBench()
    line.pass_levels(numpy.repeat(levels_of([0x00]), 2))
    assert line.framing_errors == 1 and line.take_received() == b""


def test_bytes_put_on_the_line_arrive_beside_the_sender_s():
    line = PeerLineBench()
    line.put([0xFF, 0xFF, 0x55])
    line.pass_levels(idle(40))
    line.pass_levels(levels_of([0xFF, 0xFF, 0xAA]))
    assert line.take_received() == bytes([0xFF, 0xFF, 0x55, 0xFF, 0xFF, 0xAA])


def test_both_at_once_pull_the_line_low():
    line = PeerLineBench()
    line.put([0x0F])
    both = line.pass_levels(levels_of([0x3C]))
    assert (both <= levels_of([0x3C])).all()
    assert line.take_received() == bytes([0x0F & 0x3C])


def test_garbage_comes_at_the_given_rate_and_ends():
    line = PeerLineBench()
    line.garbage(10)
    for _ in range(20):
        line.pass_levels(numpy.ones(500_000))  # 10 s
    count = line.garbage_bytes
    received = line.take_received()
    assert (
        150 < count < 350
        and len(received) + line.framing_errors <= count
        and len(received) > 0.9 * count
        and len(set(received)) > 50
    )
    line.garbage(0)
    line.pass_levels(idle(50))
    line.take_received()
    line.pass_levels(numpy.ones(1_000_000))
    assert line.garbage_bytes == count and line.take_received() == b""


def test_a_cut_line_is_idle():
    line = PeerLineBench()
    line.cut()
    assert line.pass_levels(levels_of([0x55])).all()
    line.cut(False)
    line.pass_levels(levels_of([0x55]))
    assert line.take_received() == b"\x55"


def test_each_seed_has_its_own_garbage():
    received = []
    for seed in (1, 1, 2):
        line = PeerLineBench(seed=seed)
        line.garbage(50)
        line.pass_levels(numpy.ones(500_000))
        received.append(line.take_received())
    assert received[0] == received[1] != received[2] and received[0]

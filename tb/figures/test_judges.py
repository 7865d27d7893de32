# SPDX-License-Identifier: Apache-2.0
"""The judges of s0_bus_wrong and eeprom_torn detect nodes with a planted fault; the random moves of
S0 in a bad world lie all over its travel.
"""

import zlib

import pytest

from experiments.s0_stage import random_moves
from figures import job as figures_job
from figures import s0 as figures_s0
from figures.s0 import ADDRESS, CELLS, READY, s0_bus_wrong
from moire.bus.protocol import FROM_NODE, NINTH, frame, read_words, ready_byte, write_words
from twin import cells_of
from twin.compiled import station

WRITE, READ = write_words(ADDRESS)[0], read_words(ADDRESS)[0]
ANSWER = ready_byte(ADDRESS, FROM_NODE)


def words(cells):
    """The words of the cells; None for a character without a stop bit, which a node drops together
    with its frame.
    """
    at = 0
    while at <= len(cells) - CELLS:
        if cells[at]:
            at += 1
            continue
        word = sum(bit << n for n, bit in enumerate(cells[at + 1 : at + 10]))
        yield word if cells[at + CELLS - 1] else None
        at += CELLS


class Node:
    """Replaces FrameBench: accepts a frame if `takes` does, and answers each request with `unknown
    operation`.
    """

    def __init__(self, takes):
        self.takes, self.payload, self.reply = takes, None, bytes([0, 0, 1])

    def idle(self, cells):
        pass

    def exchange(self, cells, enough=None, quiet_cells=None):
        answer = []
        for word in words([*cells, *[1] * CELLS]):
            if word == WRITE:
                self.payload, answer = b"", [READY]
            elif word == READ:
                self.payload, answer = None, [ANSWER, *frame(ANSWER, self.reply)]
            elif word is None or word & NINTH or self.payload is None:
                self.payload = None
            else:
                self.payload += bytes([word])
                if len(self.payload) >= 1 + self.payload[0] + 4:
                    if self.takes(self.payload):
                        self.reply = bytes([self.payload[1], self.payload[2], 1])
                    self.payload = None
        return answer


def crc_of(payload):
    return zlib.crc32(bytes([WRITE & 0xFF]) + payload[:-4])


def right(payload):
    return crc_of(payload) == int.from_bytes(payload[-4:], "little")


def right_but_for_the_sequence_number(payload):
    """Whether there is a sequence number with which the frame is right: this node does not check
    that byte.
    """
    return any(right(bytes([payload[0], number]) + payload[2:]) for number in range(256))


def half_right(payload):
    return crc_of(payload) & 0xFFFF == int.from_bytes(payload[-4:-2], "little")


@pytest.mark.parametrize(
    "takes, wrong",
    [
        (right, False),
        (right_but_for_the_sequence_number, True),
        (half_right, True),
        (lambda payload: True, True),
    ],
)
def test_the_bus_judge_counts_frames_that_a_node_accepts_wrongly(takes, wrong):
    assert (s0_bus_wrong(2000, lambda address: Node(takes)) > 0) == wrong


def test_nodes_in_this_file_speak_as_the_protocol_says():
    node, body = Node(right), bytes([7, 3, 0])
    assert node.exchange(cells_of([WRITE, *frame(WRITE & 0xFF, body)])) == [
        READY
    ] and node.reply == bytes([7, 3, 1])
    assert figures_s0.node_answer(node)[0].sequence == 7


def test_the_eeprom_judge_survives_an_empty_program_and_counts_it(monkeypatch):
    power_cut = station.Station.power_cut

    def wiped(self):
        power_cut(self)
        self.eeprom.memory[:] = b"\xff" * len(self.eeprom.memory)
        return True

    assert figures_job.torn(cuts=12) == 0
    monkeypatch.setattr(station.Station, "power_cut", wiped)
    assert figures_job.torn(cuts=12) > 0


class MovesOnly:
    """Replaces the stage of S0: every move ends where it should."""

    def __init__(self):
        self.axes, self.targets = {"X": None, "Y": None}, []

    def move(self, name, target_nm, progress=None):
        self.targets.append((name, target_nm))
        return name, target_nm


@pytest.mark.parametrize("seed", range(1, 6))
def test_random_moves_may_begin_all_over_the_travel(seed):
    stage = MovesOnly()
    found = random_moves(stage, 100, seed, high_nm=20e6, places=10)
    ways = [one for one in stage.targets if one not in found]
    assert len(found) == 100 and len(ways) == 20
    for name in stage.axes:
        begins = sorted(at for one, at in ways if one == name)
        assert [int(at // 2e6) for at in begins] == list(range(10))
        assert max(at for one, at in found if one == name) > 15e6
    assert all(0 <= at <= 20e6 for _, at in stage.targets)
    alone = MovesOnly()
    assert random_moves(alone, 100, seed) == alone.targets, "from one place there is no other move"

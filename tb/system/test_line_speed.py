# SPDX-License-Identifier: Apache-2.0
"""Two nodes as they ship on one line: another baud rate and the way back, positions that are followed, marks for both at once."""
import random

import pytest

from moire.client import Line
from moire.errors import NobodyAnswers
from moire.protocol import FROM_NODE, command_byte, parse_reply, read_words
from tb.bench import seed
from twin import START_S, Twin, TwinTransport

BAUD = 300_000                     # an eighth of the clk of the twin, the highest that it can do
CLK_HZ = 2_400_000
NOISE = 1000                       # of a position of 8-bit samples, 2^-16 period


@pytest.fixture
def line():
    with Twin(nodes=(1, 2), clk_hz=CLK_HZ, seed=seed() % 1000) as twin:
        made = Line(TwinTransport(twin), random_source=random.Random(seed()))
        twin.run(START_S)
        yield made


def test_both_nodes_take_another_baud_rate_and_a_break_brings_the_first_one_back(line):
    assert [node.address for node in line.find((1, 2))] == [1, 2]
    line.set_baud(BAUD, [1, 2])
    began = line.transport.now()
    line.request(1, "counters")
    assert line.transport.now() - began < 59 * 11 / 115_200        # its characters alone, at the first rate
    line.transport.set_baud(115_200)
    with pytest.raises(NobodyAnswers):
        line.identify(1, tries=1)
    line.first_baud()
    assert [node.address for node in line.find((1, 2))] == [1, 2]
    assert all(line.node(n).counters()["breaks"] == 1 for n in (1, 2))


def test_a_followed_position_is_that_of_the_moment(line):
    twin, axis = line.transport.twin, line.axis(1)
    told = axis.request("follow")["position"]
    for place in (1e-5, 3e-5):
        twin.place(0, twin.truth(0).position_nm * 1e-9 + place)
        line.transport.wait(0.01)
        line.transport.send(read_words(1))
        words = line.transport.receive(17, 0.1)
        assert words[0] == 0x40 | command_byte(1, FROM_NODE)
        now = parse_reply(bytes(words[2:-4])).fields["position"]
        assert abs(now - told) > 8 * NOISE > 0 == abs(now - axis.request("position")["position"]) // NOISE
        told = axis.request("follow")["position"]


def test_a_mark_is_captured_by_both_nodes_in_the_same_microsecond(line):
    for address in (1, 2):
        line.axis(address).capture_from("software")
    for _ in range(3):
        line.mark()
        line.transport.wait(0.003)
    taken = [line.axis(address).captures() for address in (1, 2)]
    assert [(len(captures), lost) for captures, lost in taken] == [(3, False), (3, False)]
    for first, second in zip(taken[0][0], taken[1][0], strict=True):      # reset ends for both in the same clk
        assert abs(first.time_clk - second.time_clk) / CLK_HZ < 1e-6
    assert all(line.node(n).counters()["marks"] == 3 for n in (1, 2))

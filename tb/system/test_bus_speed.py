# SPDX-License-Identifier: Apache-2.0
"""Two nodes as they ship on one bus: a change of the baud rate and back, `follow`, and syncs that
reach both nodes at once.
"""

import random

import pytest

from moire.bus.protocol import FROM_NODE, command_byte, parse_reply, read_words
from moire.client.bus import Bus
from moire.errors import NoAnswer
from tb.bench import seed
from twin import Twin, TwinTransport

BAUD = 300_000  # the highest rate of the twin: an eighth of its clock
CLK_HZ = 2_400_000
NOISE = 1000  # noise of a position from 8-bit samples, 2^-16 period


@pytest.fixture
def bus():
    with Twin(nodes=(1, 2), clk_hz=CLK_HZ, seed=seed() % 1000) as twin:
        made = Bus(TwinTransport(twin), random_source=random.Random(seed()))
        twin.run_until_ready()
        yield made


def test_both_nodes_take_another_baud_rate_and_a_break_brings_the_first_one_back(bus):
    assert [node.address for node in bus.find((1, 2))] == [1, 2]
    bus.set_baud(BAUD, [1, 2])
    took = []
    for _ in range(3):  # the soft core may be busy with something else
        began = bus.transport.now()
        bus.request(1, "counters")
        took.append(bus.transport.now() - began)
    assert min(took) < 59 * 11 / 115_200, "the time of its characters alone, at the first rate"
    bus.transport.set_baud(115_200)
    with pytest.raises(NoAnswer):
        bus.identify(1, tries=1)
    bus.first_baud()
    assert [node.address for node in bus.find((1, 2))] == [1, 2]
    assert all(bus.node(n).counters()["breaks"] == 1 for n in (1, 2))


def test_follow_returns_the_present_position(bus):
    twin, axis = bus.transport.twin, bus.axis(1)
    reported = axis.request("follow")["position"]
    for offset in (1e-5, 3e-5):
        twin.set_position(0, twin.truth(0).position_nm * 1e-9 + offset)
        bus.transport.wait(0.01)
        bus.transport.send(read_words(1))
        words = bus.transport.receive(17, 0.1)
        assert words[0] == 0x40 | command_byte(1, FROM_NODE)
        now = parse_reply(bytes(words[2:-4])).fields["position"]
        assert (
            abs(now - reported)
            > 8 * NOISE
            > 0
            == abs(now - axis.request("position")["position"]) // NOISE
        )
        reported = axis.request("follow")["position"]


def test_a_sync_is_captured_by_both_nodes_in_the_same_microsecond(bus):
    for address in (1, 2):
        bus.axis(address).capture_from("software")
    for _ in range(3):
        bus.sync()
        bus.transport.wait(0.003)
    taken = [bus.axis(address).captures() for address in (1, 2)]
    assert [(len(captures), lost) for captures, lost in taken] == [(3, False), (3, False)]
    for first, second in zip(
        taken[0][0], taken[1][0], strict=True
    ):  # reset ends in both nodes in the same cycle
        assert abs(first.time_clk - second.time_clk) / CLK_HZ < 1e-6
    assert all(bus.node(n).counters()["syncs"] == 3 for n in (1, 2))

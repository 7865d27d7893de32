# SPDX-License-Identifier: Apache-2.0
"""Recorded levels of a real optical mouse sensor (HDNS-2000), and step and direction of a real
Smoothieware controller, pass through deglitcher and decoder, clean and with spikes. The counts must
equal those of a plain offline decoder at every recorded edge.

A recording has millions of samples, mostly without a change. One sample is one cycle, but a stretch
without any edge is cut to STILL cycles, eight times the setting of the deglitcher; the order of the
edges and every shorter distance are kept.
"""

import os
import random
from itertools import accumulate, islice, pairwise

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge

from tb import bench
from tb.decode.quadrature_decoder import PULSES, X4
from twin.recordings import CAPTURES, rows

RECORDINGS = [("hdns2000_fast", X4), ("hdns2000_left_right", X4), ("smoothieware_steps", PULSES)]
ROWS = 5000  # longest part of a recording that is used
STABLE = 5  # setting of the deglitchers, cycles
STILL = 40  # longest stretch without an edge, cycles
NAMES = ["x clean", "y clean", "x with spikes", "y with spikes"]


def recording(name):
    """Rows of (duration in cycles, xa, xb, ya, yb); a is step, b is direction where these are
    recorded.
    """
    changes = list(islice(rows(CAPTURES / f"{name}.csv"), ROWS))
    ends = [row[0] for row in changes[1:]] + [changes[-1][0] + STILL]
    return [(min(end - row[0], STILL), *row[1:]) for row, end in zip(changes, ends)]


def offline(levels, mode):
    """The count after each (a, b) of a list, and the number of counted events: edges by the leading
    channel, or pulses by their direction; nothing is filtered.
    """
    moves = []
    for (a, b), (a_now, b_now) in pairwise(levels):
        assert (a, b) == (a_now, b_now) or (a == a_now) != (b == b_now), (
            "the recording itself has an illegal edge"
        )
        if mode == PULSES:
            moves.append((-1 if b_now else +1) if a_now > a else 0)
        elif a != a_now:
            moves.append(+1 if a_now != b_now else -1)
        elif b != b_now:
            moves.append(+1 if b_now == a_now else -1)
        else:
            moves.append(0)
    return list(accumulate(moves, initial=0)), sum(map(abs, moves))


def spikes(duration):
    """A pulse too short to pass, somewhere in a stretch and clear of both ends: (first cycle, cycle
    after the last).
    """
    width = random.randrange(1, STABLE)
    first = random.randrange(1, duration - width)
    return first, first + width


async def play(dut, rows):
    """Play the rows, with spikes on pairs 2 and 3; return the counts at the end of each row, and
    the numbers of spikes on x, y.
    """
    counts, sent = [], [0, 0]
    for duration, xa, xb, ya, yb in rows:
        clean_a, clean_b = xa | ya << 1, xb | yb << 1
        levels_a, levels_b = clean_a | clean_a << 2, clean_b | clean_b << 2
        changes = {
            0: (0, 0),
            duration: (0, 0),
        }  # cycle within the row -> levels inverted from there on, a and b
        if duration > 2 * STABLE:
            for line in range(4):  # xa, xb, ya, yb
                if random.random() < 0.5:
                    begin, end = spikes(duration)
                    mask = 4 << line // 2
                    sent[line // 2] += 1
                    for cycle in (begin, end):
                        turned = list(changes.get(cycle, (0, 0)))
                        turned[line % 2] ^= mask
                        changes[cycle] = tuple(turned)
        turned_a = turned_b = 0
        for now, then in pairwise(sorted(changes)):
            turned_a, turned_b = turned_a ^ changes[now][0], turned_b ^ changes[now][1]
            dut.a.value, dut.b.value = levels_a ^ turned_a, levels_b ^ turned_b
            await ClockCycles(dut.clk, then - now, FallingEdge)
        counts.append(dut.counts.value)
    return counts, sent


def words(value):
    """The four 32-bit words of a port, pair 0 first."""
    whole = int(value)
    return [whole >> 32 * pair & 0xFFFFFFFF for pair in range(4)]


@cocotb.test()
async def every_count_is_that_of_the_offline_decoder_with_and_without_spikes(dut):
    rows, mode = recording(os.environ["RECORDING"]), int(os.environ["MODE"])
    first = rows[0]
    a, b = first[1] | first[3] << 1, first[2] | first[4] << 1
    await bench.start(dut, stable_cycles=STABLE, mode=mode, a=a | a << 2, b=b | b << 2)
    await ClockCycles(
        dut.clk, STILL, FallingEdge
    )  # filters and decoders have taken the first levels
    seen, sent = await play(dut, rows)
    await ClockCycles(dut.clk, 4 * STABLE, FallingEdge)

    expected = [offline([row[at : at + 2] for row in rows], mode) for at in (1, 3)] * 2
    for pair, (counts, edges) in enumerate(expected):
        assert edges > 20, "a recording without motion proves nothing"
        end, total, held = (
            words(port.value)[pair] for port in (dut.counts, dut.edges, dut.rejections)
        )
        assert end == counts[-1] & 0xFFFFFFFF, f"{NAMES[pair]}: {end} counted, {counts[-1]} offline"
        assert total == edges, f"{NAMES[pair]}: {total} edges counted, {edges} offline"
        assert held == ([0, 0] + sent)[pair], f"{NAMES[pair]}: {held} pulses held back"
        for number, (row, value) in enumerate(zip(rows, seen)):
            if row[0] == STILL:  # long enough for every earlier edge to have passed
                got = words(value)[pair]
                assert got == counts[number] & 0xFFFFFFFF, (
                    f"{NAMES[pair]}, row {number}: {got} counted, {counts[number]} offline"
                )
    assert not int(dut.illegal.value)
    assert min(sent) > 200
    dut._log.info("edges x %d, y %d; spikes %d, %d", expected[0][1], expected[1][1], *sent)


@pytest.mark.parametrize("name, mode", RECORDINGS)
def test_recordings(name, mode, monkeypatch):
    if not (CAPTURES / f"{name}.csv").exists():
        pytest.skip(f"no recording {name}.csv in {CAPTURES.name}/ beside the checkout")
    monkeypatch.setenv("RECORDING", name)
    monkeypatch.setenv("MODE", str(mode))
    bench.run("recorded_encoder", __file__)

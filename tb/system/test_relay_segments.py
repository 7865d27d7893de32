# SPDX-License-Identifier: Apache-2.0
"""relay with a segment table instead of harmonics, from pins to pins: it corrects in both
directions and refuses other sets.
"""

import cocotb

from moire.client.relay import identity_of
from tb.bench import run, steady_only
from tb.relay.relay_set import image
from tb.system.test_relay import (
    BAUD,
    BIT,
    CORRECTING,
    COUNTS,
    FIRST,
    GATED,
    KNOWN,
    LOADED,
    REFUSED,
    SECOND,
    Relay,
)

SEGMENTS = 5
POINTS = 0.0, 3.5, -2.0, 6.25, 1.0  # counts at the borders


def set_of(points):
    words = [round(value * 65536) for value in (*points, 0)]
    return image(list(zip(words[::2], words[1::2])), COUNTS, segments=SEGMENTS, **GATED)


def corrected(count):
    """The corrected position, counts."""
    n, inside = divmod(count % COUNTS * SEGMENTS / COUNTS, 1)
    low, high = POINTS[int(n)], POINTS[(int(n) + 1) % SEGMENTS]
    return count - low - (high - low) * inside


@cocotb.test()
async def it_corrects_by_the_table_in_both_directions(dut):
    assert int(dut.BAUD.value) * BIT == int(dut.CLK_HZ.value)
    relay = await Relay(dut).power_up(count=-20)
    await relay.booted()
    await relay.send_set(set_of(POINTS))
    await relay.go(40, clk_each=4)
    for goal in (400, 800, 1000, 2000, 2300, 1200, 3999, 4100, -300, 10):
        await relay.go(goal - relay.count)
        await relay.clk(100)
        assert abs(relay.counted - corrected(relay.count)) <= 0.76, (relay.count, relay.counted)
    status = await relay.status()
    assert (
        status.levels == KNOWN | LOADED | CORRECTING
        and status.orders == 0
        and not status.flags & ~16
    )


@cocotb.test()
async def latency_is_10(dut):
    steady_only("a latency to the cycle")
    assert await (await Relay(dut).power_up()).latencies() == [10] * 4


@cocotb.test()
async def a_set_of_harmonics_is_refused(dut):
    relay = await Relay(dut).power_up()
    await relay.booted()
    relay_set = set_of(POINTS)
    assert (await relay.send_set(relay_set)).identity == identity_of(relay_set)
    answer = await relay.send_set(image([(100, 0)] * 3, COUNTS))
    assert answer.flags == REFUSED and answer.identity == identity_of(relay_set)


@cocotb.test()
async def a_saved_table_comes_back_at_power_up(dut):
    relay = Relay(dut)
    relay_set = set_of(POINTS)
    relay.chip.memory[SECOND : SECOND + len(relay_set)] = relay_set
    await relay.power_up()
    await relay.booted()
    status = await relay.status()
    assert (
        status.source == 2 and status.levels == LOADED and status.identity == identity_of(relay_set)
    )


def test_relay_segments():
    run("relay", __file__, SEGMENTS=SEGMENTS, BAUD=BAUD, FIRST=FIRST, SECOND=SECOND)

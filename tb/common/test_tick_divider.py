# SPDX-License-Identifier: Apache-2.0
"""Tests of tick_divider: exact periods at both ends of the range, a period changed while it runs, a
restart, and random settings against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start
from tb.common.tick_divider import TickDivider


async def cycle(dut, period, restart=0, rst=0):
    dut.period.value, dut.restart.value, dut.rst.value = period, restart, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.tick.value)


async def ticks(dut, period, n):
    """The numbers of the cycles, counted from 1, in which a tick came."""
    return [k for k in range(1, n + 1) if await cycle(dut, period)]


@cocotb.test()
async def latency_is_period_to_the_first_tick_and_between_ticks(dut):
    longest = (1 << int(dut.W.value)) - 1
    await start(dut, period=0, restart=0)
    for period in (1, 2, 3, 10, min(longest, 1000)):
        await cycle(dut, period, rst=1)
        assert await ticks(dut, period, 3 * period) == [period, 2 * period, 3 * period]


@cocotb.test()
async def each_bit_of_the_period_alone_and_any_upper_bits_are_exact(dut):
    await start(dut, period=0, restart=0)
    upper = [random.randrange(128, 256) for _ in range(20)]
    for period in [*(1 << n for n in range(8)), *upper]:
        await cycle(dut, period, rst=1)
        assert await ticks(dut, period, period) == [period]


@cocotb.test()
async def the_longest_period_is_exact(dut):
    longest = (1 << int(dut.W.value)) - 1
    needs(longest < 1 << 10, "the longest period takes too long, and a narrow build shows as much")
    await start(dut, period=0, restart=0)
    assert await ticks(dut, longest, 2 * longest) == [longest, 2 * longest]


@cocotb.test()
async def period_0_never_ticks_and_the_next_period_begins_whole(dut):
    await start(dut, period=5, restart=0)
    await ticks(dut, 5, 3)
    assert await ticks(dut, 0, 100) == []
    assert await ticks(dut, 5, 10) == [5, 10]


@cocotb.test()
async def a_shorter_period_takes_effect_at_once(dut):
    await start(dut, period=0, restart=0)
    assert await ticks(dut, 200, 50) == []
    assert await ticks(dut, 20, 41) == [1, 21, 41]
    assert await ticks(dut, 30, 30) == [30]


@cocotb.test()
async def latency_is_period_from_a_restart_at_any_time(dut):
    await start(dut, period=0, restart=0)
    for before in range(13):
        await cycle(dut, 10, rst=1)
        await ticks(dut, 10, before)
        assert await cycle(dut, 10, restart=1) == 0  # even if a tick was due
        assert await ticks(dut, 10, 20) == [10, 20]


@cocotb.test()
async def any_setting_matches_the_model(dut):
    await start(dut, period=0, restart=0)
    model, period, w = TickDivider(), 0, int(dut.W.value)
    for n in range(5000):
        if random.random() < 0.05:
            large = 1 << random.randrange(w), random.getrandbits(w)
            period = random.choice([0, 1, 2, random.randrange(40), *large])
        restart, rst = int(random.random() < 0.05), int(random.random() < 0.01 or n == 0)
        assert await cycle(dut, period, restart, rst) == model.step(period, restart, rst), (
            f"cycle {n}"
        )


@pytest.mark.parametrize("w", [8, 24])
def test_tick_divider(w):
    run("tick_divider", __file__, W=w)

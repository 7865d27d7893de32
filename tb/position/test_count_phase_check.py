# SPDX-License-Identifier: Apache-2.0
"""Tests of count_phase_check: an undisturbed scale agrees, a lost fringe is detected, shifts hide
nothing, and every cycle against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.count_phase_check import CountPhaseCheck

IDLE = dict(limit=0, valid=0, position=0, count=0, shift=0, shift_periods=0)
LIMIT = 32768  # as in tables/bus.toml: halfway between the quarter period between two counts and
# the 3/4 period that a lost fringe leaves at least


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def again(dut):
    """Reset while the clock runs."""
    dut.rst.value, dut.valid.value = 1, 0
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def clock(dut, position, count, valid=1, limit=LIMIT, shift=0, shift_periods=0):
    dut.position.value, dut.count.value, dut.valid.value, dut.limit.value = (
        position,
        count,
        valid,
        limit,
    )
    dut.shift.value, dut.shift_periods.value = shift, shift_periods
    await FallingEdge(dut.clk)
    return int(dut.disagreement.value)


async def settle(dut, position, count, limit=LIMIT):
    """Wait long enough for two positions to pass."""
    return [await clock(dut, position, count, limit=limit) for _ in range(6)][-1]


@cocotb.test()
async def latency_is_3(dut):
    await begin(dut)
    await settle(dut, 0, 0)
    dut.position.value, cycle = LIMIT + 1, 0
    while not int(dut.disagreement.value):
        await RisingEdge(dut.clk)
        cycle += 1
        await FallingEdge(dut.clk)
        assert cycle <= 3
    assert cycle == 3


@cocotb.test()
async def the_limit_itself_still_agrees(dut):
    await begin(dut)
    for limit in (1, LIMIT, (1 << 20) - 1):
        for direction in (1, -1):
            await again(dut)
            await settle(dut, 1000, 7, limit)
            assert not await settle(dut, 1000 + direction * limit, 7, limit)
            assert await settle(dut, 1000 + direction * (limit + 1), 7, limit)
            assert not await settle(dut, 1000 + direction * (limit + 16384), 7 + direction, limit)


@cocotb.test()
async def a_scale_in_motion_with_a_late_count_agrees(dut):
    await begin(dut)
    position, speed, lag = 12345, 0, 3  # the count is that of three samples before
    past = [position] * (lag + 1)
    for _ in range(3000):
        speed = max(-4096, min(4096, speed + random.randrange(-300, 301)))
        position += speed
        past = past[1:] + [position]
        assert not await clock(
            dut, position, past[0] >> 14
        )  # 1/4 + 3 * 4096 / 65536 period is below the limit


@cocotb.test()
async def one_lost_fringe_shows_in_both_directions(dut):
    await begin(dut)
    for lost in (65536, -65536):
        await again(dut)
        await settle(dut, 5000, 0)
        assert await settle(dut, 5000 + lost, 0)
        assert await settle(dut, 5000 + lost + 16384, 1)
        assert not await settle(dut, 5000 + 16384, 1)


@cocotb.test()
async def a_lost_fringe_shows_at_the_next_position_wherever_the_constant_was_learned(dut):
    await begin(dut)
    for reference in (0, 1, 8000, 16383):  # position within a count
        for place in (0, 16383):
            for lost in (65536, -65536):
                await again(dut)
                await settle(dut, reference, 0)
                assert not await settle(dut, place, 0)
                await clock(dut, place + lost, 0)
                assert [await clock(dut, place + lost, 0) for _ in range(2)] == [0, 1]


@cocotb.test()
async def a_shift_hides_no_disagreement_and_makes_none(dut):
    await begin(dut)
    for periods in (3, -100_000, (1 << 31) - 1):
        await again(dut)
        await settle(dut, 5000, 0)
        await clock(dut, 5000, 0, shift=1, shift_periods=periods)
        here = (5000 + (periods << 16) + (1 << 47)) % (1 << 48) - (1 << 47)
        for _ in range(6):
            assert not await clock(dut, here, 0)
        assert await settle(dut, here - 65536, 0)
        await clock(dut, here - 65536, 0, shift=1, shift_periods=-1)
        assert await settle(dut, here - 131072, 0)


@cocotb.test()
async def a_shift_by_0_periods_or_limit_0_learns_the_constant_again(dut):
    await begin(dut)
    await settle(dut, 0, 0)
    assert await settle(dut, 65536, 0)
    await clock(dut, 65536, 0, shift=1, shift_periods=0)
    assert not await settle(dut, 65536, 0)
    assert await settle(dut, 131072, 0)
    assert not await clock(dut, 131072, 0, limit=0)
    await settle(dut, 131072, 0, limit=0)
    assert not await settle(dut, 131072, 0)
    assert await settle(dut, 65536, 0)


@cocotb.test()
async def the_count_wraps_without_a_disagreement(dut):
    await begin(dut)
    for count in ((1 << 31) - 1, -1 << 31, (1 << 31) - 2):
        assert not await settle(dut, (count % (1 << 32)) << 14, count)


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    model, position, count = CountPhaseCheck(), 0, 0
    for cycle in range(20_000):
        rst, valid, shift = (int(random.random() < share) for share in (0.002, 0.5, 0.05))
        moved = random.choice(
            (0, 0, 0, 1, -1, random.randrange(-1 << 30, 1 << 30) if random.random() < 0.02 else 1)
        )
        position, count = position + (moved << 14) + random.randrange(-3, 4), count + moved
        limit = random.choice((LIMIT, LIMIT, LIMIT, 20, 1 << 19, 0 if random.random() < 0.1 else 5))
        periods = random.choice((0, 1, -5, random.randrange(-1 << 31, 1 << 31)))
        position, count = (
            (v + (1 << n - 1)) % (1 << n) - (1 << n - 1) for v, n in ((position, 48), (count, 32))
        )
        dut.rst.value = rst
        got = await clock(dut, position, count, valid, limit, shift, periods)
        want = model.step(limit, valid, position, count, shift, periods)
        if rst:
            model, want = CountPhaseCheck(), 0
        assert got == want, f"cycle {cycle}"
        position += shift * periods << 16


def test_count_phase_check():
    run("count_phase_check", __file__)

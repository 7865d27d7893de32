# SPDX-License-Identifier: Apache-2.0
"""Tests of count_phase_check: an undisturbed scale agrees, a lost fringe is detected, nothing
depends on where the origin is, and every cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.position.count_phase_check import LATENCY, CountPhaseCheck

IDLE = dict(learn=0, valid=0, axis=0, step=0, count=0, limit=0)
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


async def clock(dut, step, count, valid=1, limit=LIMIT, learn=0, axis=0):
    """Advance one cycle; returns the levels of all axes."""
    dut.step.value, dut.count.value, dut.valid.value, dut.limit.value = step, count, valid, limit
    dut.learn.value, dut.axis.value = learn, axis
    await FallingEdge(dut.clk)
    return int(dut.disagreement.value)


async def settle(dut, step, count, limit=LIMIT, axis=0):
    """Take a step, and wait until it is judged."""
    await clock(dut, step, count, limit=limit, axis=axis)
    for _ in range(LATENCY - 1):
        level = await clock(dut, 0, count, valid=0, limit=limit, axis=axis)
    return level >> axis & 1


@cocotb.test()
async def latency_is_3(dut):
    await begin(dut)
    await settle(dut, 0, 0)
    levels = [await clock(dut, LIMIT + 1, 0)]
    levels += [await clock(dut, 0, 0, valid=0) for _ in range(3)]
    assert levels == [0, 0, 1, 1]


@cocotb.test()
async def the_limit_itself_still_agrees(dut):
    await begin(dut)
    for limit in (1, LIMIT, 65535):
        for direction in (1, -1):
            await again(dut)
            await settle(dut, 1000, 7, limit)
            assert not await settle(dut, direction * limit, 7, limit)
            assert await settle(dut, direction, 7, limit)
            assert not await settle(dut, direction * 16383, 7 + direction, limit)
    await again(dut)
    largest = (1 << 20) - 1
    await settle(dut, 0, 0, largest)
    for step in [65535] * 16 + [15]:
        assert not await settle(dut, step, 0, largest)
    assert await settle(dut, 1, 0, largest)


@cocotb.test()
async def a_scale_in_motion_with_a_late_count_agrees(dut):
    await begin(dut)
    position, speed, lag = 12345, 0, 3  # the count is that of three samples before
    past = [position] * (lag + 1)
    for _ in range(3000):
        speed = max(-4096, min(4096, speed + random.randrange(-300, 301)))
        position += speed
        past = past[1:] + [position]
        # 1/4 + 3 * 4096 / 65536 period is below the limit
        assert not await clock(dut, speed, past[0] >> 14)


@cocotb.test()
async def one_lost_fringe_shows_in_both_directions(dut):
    await begin(dut)
    for lost in (65535, -65535):
        await again(dut)
        await settle(dut, 0, 0)
        assert await settle(dut, lost, 0)
        assert await settle(dut, 16384, 1)
        assert not await settle(dut, -lost, 1)


@cocotb.test()
async def learning_again_or_limit_0_ends_a_disagreement(dut):
    await begin(dut)
    await settle(dut, 0, 0)
    assert await settle(dut, 65535, 0)
    assert not await clock(dut, 0, 0, valid=0, learn=1)
    assert not await settle(dut, 0, 0)
    assert await settle(dut, -40000, 0)
    assert not await settle(dut, 0, 0, limit=0)
    assert not await settle(dut, 0, 0)
    assert await settle(dut, 40000, 0)


@cocotb.test()
async def learning_forgets_what_is_not_judged_yet(dut):
    await begin(dut)
    for after in range(LATENCY + 1):  # cycles from a step that disagrees
        await again(dut)
        await settle(dut, 0, 0)
        await clock(dut, 65535, 0, learn=int(after == 0))
        for n in range(1, 2 * LATENCY):
            level = await clock(dut, 0, 0, valid=0, learn=int(n == after))
            assert level == int(LATENCY - 1 <= n < after)


@cocotb.test()
async def the_count_wraps_without_a_disagreement(dut):
    await begin(dut)
    await settle(dut, 0, (1 << 31) - 1)
    assert not await settle(dut, 16384, -1 << 31)
    assert not await settle(dut, -32768, (1 << 31) - 2)
    assert await settle(dut, 65535, (1 << 31) - 2)


@cocotb.test()
async def a_difference_shows_up_to_the_wrap_at_65536_periods(dut):
    await begin(dut)
    for count in (
        *(sign << bit for bit in range(2, 18) for sign in (1, -1)),
        3,
        (1 << 18) - 3,
        1 << 31,
    ):
        await again(dut)
        await settle(dut, 0, 0)
        far = count % (1 << 18) != 0
        assert await settle(dut, 0, count - (count >> 31 << 32)) == far


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    axes = int(dut.AXES.value)
    model, counts = CountPhaseCheck(axes), [0] * axes
    for cycle in range(20_000):
        rst, valid, learn = (int(random.random() < share) for share in (0.001, 0.7, 0.01))
        axis = random.randrange(axes)
        moved = random.choice((0, 0, 1, -1, 3, -4 if random.random() < 0.1 else 0))
        counts[axis] += moved * valid
        count = (counts[axis] + (1 << 31)) % (1 << 32) - (1 << 31)
        if random.random() < 0.002:
            counts[axis] = random.choice((0, (1 << 31) - 3, -1 << 31))
        step = max(-65536, min(65535, (moved << 14) + random.randrange(-3, 4)))
        if random.random() < 0.003:
            step = random.choice((-65536, 65535, 30000))
        limit = random.choice((LIMIT, LIMIT, LIMIT, 20000, (1 << 20) - 1, 5))
        limit = 0 if random.random() < 0.01 else limit
        learn <<= random.randrange(axes)
        dut.rst.value = rst
        got = await clock(dut, step, count, valid, limit, learn, axis)
        want = model.step(learn, valid, axis, step, count, limit)
        if rst:
            model, want = CountPhaseCheck(axes), 0
        assert got == want, f"cycle {cycle}"


@pytest.mark.parametrize("axes", [1, 5])
def test_count_phase_check(axes):
    run("count_phase_check", __file__, AXES=axes)

# SPDX-License-Identifier: Apache-2.0
"""approach_law: every decision against the model, and the ways to zero that its decisions make."""
import random

import cocotb
import pytest
from cocotb.triggers import Timer

from approach_law import Approach, decide
from bench import run


async def decided(dut, change, limit, value, slope, upward, area):
    dut.change.value, dut.limit.value, dut.value.value, dut.slope.value = change, limit, value, slope
    dut.upward.value, dut.area.value = upward, area
    await Timer(1, "ns")
    return tuple(int(getattr(dut, name).value) for name in ("turn", "upward_now", "last", "grow", "fall"))


@cocotb.test()
async def by_hand(dut):
    for value, decision in ((0, (1, 0, 1, 0, 0)), (4, (1, 0, 1, 0, 0)), (5, (1, 0, 0, 1, 0)), (-4, (1, 1, 1, 0, 0)), (-5, (1, 1, 0, 1, 0))):
        assert await decided(dut, 5, 50, value, 0, 0, 0) == decision
    for value, decision in ((14, (0, 0, 0, 0, 1)), (15, (0, 0, 0, 0, 0)), (29, (0, 0, 0, 0, 0)), (30, (0, 0, 0, 1, 0))):
        assert await decided(dut, 5, 50, value, 10, 0, 15) == decision       # 10 + 5 to go, 15 + 10 + 5 with one more
        assert await decided(dut, 5, 50, -value, 10, 1, 15) == (0, 1, *decision[2:])
    assert await decided(dut, 5, 10, 30, 10, 0, 15) == (0, 0, 0, 0, 0)       # at the limit
    assert await decided(dut, 5, 9, 30, 10, 0, 15) == (0, 0, 0, 0, 1)        # above it


@cocotb.test()
async def every_decision_matches_the_model(dut):
    width = int(dut.W.value)
    word = lambda bits: random.getrandbits(bits) >> random.randrange(bits)
    for _ in range(5000):
        change, slope, limit, area = word(width - 1), word(width) * random.randrange(2), word(width), word(width)
        value = random.choice((1, -1)) * word(width - 1)
        if random.randrange(2):
            value = random.choice((1, -1)) * (area + slope + change + random.randrange(-1, 2))
        value = max(-1 << width - 1, min((1 << width - 1) - 1, value))
        given = change, limit, value, slope, random.randrange(2), area
        assert await decided(dut, *given) == decide(*given), given
    for value in (-1 << width - 1, (1 << width - 1) - 1):
        for slope in (0, (1 << width) - 1):
            given = (1 << width) - 1, (1 << width) - 1, value, slope, 1, (1 << width) - 1
            assert await decided(dut, *given) == decide(*given), given


@cocotb.test()
async def every_way_ends_at_zero_within_the_limits_and_in_the_shortest_time(dut):
    for _ in range(300):
        change = random.randrange(1, 1000)
        limit = change * random.randrange(1, 60) + random.randrange(change)
        value = size = random.choice((1, -1)) * int(10 ** random.uniform(0, 7))
        law, slopes, end = Approach(), [0], False
        while not end:
            before = value
            value, end = law.step(value, change, limit)
            slopes.append(value - before)
        assert value == 0
        slopes.append(0)
        assert all(abs(b - a) <= change for a, b in zip(slopes, slopes[1:])) and max(map(abs, slopes)) <= limit
        assert all(s * size <= 0 for s in slopes)               # it does not swing across
        size, limit = abs(size), limit // change * change
        best = size / limit + limit / change if limit * limit <= size * change else 2 * (size / change) ** 0.5
        assert len(slopes) - 2 <= best + 4


@pytest.mark.parametrize("width", [8, 64])
def test_approach_law(width):
    run("approach_law", __file__, W=width)

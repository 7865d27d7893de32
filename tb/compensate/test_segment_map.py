# SPDX-License-Identifier: Apache-2.0
"""segment_map: points by hand, latency and length of a round, the last border, lag in motion,
swaps, and any motion against the model.
"""

import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.compensate.segment_map import SegmentMap

IDLE = dict(enable=0, write=0, term=0, even=0, odd=0, swap=0, angle=0, position=0)
STROBES = "write", "swap"
TURN = 1 << 32
LARGEST = (1 << 23) - 1


class Map:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.inputs = dut, dict(IDLE)
        self.segments = int(dut.SEGMENTS.value)
        self.model = SegmentMap(self.segments)
        self.round = self.model.round

    async def reset(self, points):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        await self.give([0] * self.segments)  # clears what an earlier test left in the other set
        await self.give(points)
        return self

    async def put(self, points):
        padded = [*points, 0]
        for term in range((self.segments + 1) // 2):
            await self.clk(write=1, term=term, even=padded[2 * term], odd=padded[2 * term + 1])
            await self.clk(2)

    async def give(self, points):
        """Write a set of points and put it in force."""
        await self.put(points)
        await self.clk(swap=1, enable=1)

    async def clk(self, count=1, rst=0, **inputs):
        for _ in range(count):
            self.inputs.update(inputs)
            for name, level in self.inputs.items():
                getattr(self.dut, name).value = level
            self.dut.rst.value = rst
            self.model.clk(rst=rst, **self.inputs)
            await RisingEdge(self.dut.clk)
            await FallingEdge(self.dut.clk)
            for name in ("correction", "corrected"):
                got, want = getattr(self.dut, name).value.to_signed(), getattr(self.model, name)
                assert got == want, f"{self.inputs}: {name} is {got}, the model has {want}"
            assert bool(self.dut.refreshed.value) == self.model.refreshed
            for name in STROBES:
                self.inputs[name] = 0

    async def at(self, angle):
        """The correction at standstill at this angle."""
        await self.clk(2 * self.round + 2, angle=angle % TURN)
        return self.model.correction


def any_points(count, reach=LARGEST):
    return [random.randint(-reach - 1, reach) for _ in range(count)]


@cocotb.test()
async def points_and_the_middles_between_them_are_as_worked_out_by_hand(dut):
    points = [1000 * n for n in range(int(dut.SEGMENTS.value))]
    design = await Map(dut).reset(points)
    for n in range(design.segments - 1):
        assert abs(await design.at(n * TURN // design.segments + 1) - points[n]) <= 1
        assert (
            abs(await design.at((2 * n + 1) * TURN // (2 * design.segments)) - points[n] - 500) <= 1
        )
    await design.clk(3, position=77)
    assert design.model.corrected == (77 << 16) - design.model.correction


@cocotb.test()
async def the_last_border_is_the_first(dut):
    design = await Map(dut).reset([6000] + [0] * (int(dut.SEGMENTS.value) - 1))
    assert abs(await design.at(TURN - 1) - 6000) <= 1
    assert abs(await design.at(TURN - TURN // (2 * design.segments)) - 3000) <= 1
    assert abs(await design.at(0) - 6000) <= 1


@cocotb.test()
async def latency_is_3(dut):
    design = await Map(dut).reset([0] * int(dut.SEGMENTS.value))
    await design.clk(4, position=5)
    seen = []  # position changes one cycle after step
    await design.clk(position=6)
    for _ in range(3):
        seen.append(design.model.corrected >> 16)
        await design.clk()
    assert seen == [5, 6, 6]


@cocotb.test()
async def a_round_takes_the_bits_of_a_border_number_and_23_cycles(dut):
    design = await Map(dut).reset(any_points(int(dut.SEGMENTS.value)))
    times = []
    for n in range(6 * design.round):
        await design.clk()
        if design.model.refreshed:
            times.append(n)
    assert {b - a for a, b in zip(times, times[1:])} == {
        math.ceil(math.log2(2 * design.segments + 2)) + 23
    }


@cocotb.test()
async def in_motion_it_lags_by_two_rounds_at_most(dut):
    count = int(dut.SEGMENTS.value)
    points = [65536 * (n if n < count / 2 else count - n) // count for n in range(count)]
    design = await Map(dut).reset(points)
    each = TURN // 32768
    for direction in (each, -each):
        angle = random.randrange(TURN)
        await design.at(angle)
        for _ in range(8 * design.round):
            angle = (angle + direction) % TURN
            await design.clk(angle=angle)
            place = angle * count / TURN
            low, high = points[int(place)], [*points, points[0]][int(place) + 1]
            assert (
                abs(design.model.correction - low - (high - low) * (place % 1))
                <= 2 * design.round * 65536 / 32768 + 2
            )


@cocotb.test()
async def a_set_comes_into_force_as_a_whole(dut):
    count = int(dut.SEGMENTS.value)
    design = await Map(dut).reset([2000] * count)
    was, then = 2000, -5000
    for wait in (0, 1, design.round - 1, design.round, design.round + 1):
        await design.at(12345)
        await design.put([then] * count)
        await design.clk(design.round + wait)
        assert design.model.correction == was
        await design.clk(swap=1)
        for _ in range(3 * design.round):
            await design.clk(angle=random.getrandbits(32))
            assert design.model.correction in (was, then)
        assert design.model.correction == then
        was, then = then, was


@cocotb.test()
async def largest_points_do_not_overflow(dut):
    ends = -LARGEST - 1, LARGEST
    design = await Map(dut).reset([ends[n % 2] for n in range(int(dut.SEGMENTS.value))])
    for angle in (0, 1, TURN - 1, TURN // 2, *(random.getrandbits(32) for _ in range(5))):
        assert ends[0] <= await design.at(angle) <= ends[1]


@cocotb.test()
async def nothing_is_corrected_before_the_first_set_nor_without_enable(dut):
    design = Map(dut)
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    await design.clk(rst=1)
    await design.clk(3 * design.round, enable=1)
    assert design.model.correction == 0
    await design.give([9] * design.segments)
    assert await design.at(5) == 9
    await design.clk(1, enable=0)
    assert design.model.correction == 0


@cocotb.test()
async def reset_in_a_round_ends_the_correction_until_the_next_swap(dut):
    design = await Map(dut).reset([9] * int(dut.SEGMENTS.value))
    for wait in (1, 5, design.round - 1, design.round):
        await design.clk(wait)
        await design.clk(rst=1)
        await design.clk(3 * design.round)
        assert design.model.correction == 0  # a set must be swapped in again
        await design.give([9] * design.segments)
        assert await design.at(5) == 9


@cocotb.test()
async def any_motion_matches_the_model(dut):
    design = await Map(dut).reset(any_points(int(dut.SEGMENTS.value)))
    angle = 0
    for _ in range(60):
        if random.randrange(3) == 0:
            await design.put(any_points(design.segments, random.choice((100, LARGEST))))
        for _ in range(random.randrange(60)):
            angle = random.choice(
                (
                    angle,
                    (angle + random.choice((-1, 1)) * TURN // 4000) % TURN,
                    random.getrandbits(32),
                )
            )
            await design.clk(
                angle=angle,
                position=random.getrandbits(32),
                swap=int(random.randrange(40) == 0),
                enable=int(random.randrange(30) > 0),
                rst=int(random.randrange(500) == 0),
            )


@pytest.mark.parametrize("segments", [2, 5, 36, 64])
def test_segment_map(segments):
    run("segment_map", __file__, SEGMENTS=segments)

# SPDX-License-Identifier: Apache-2.0
"""segment_correction: errors by hand in both directions, a target that takes its steps, the lag in
motion, shifts, reading back, and any motion against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.compensate.segment_correction import SegmentCorrection, wrap

IDLE = dict(
    enable=0,
    linear=0,
    origin_written=0,
    origin=0,
    segment_length=1,
    segments=1,
    write=0,
    point=0,
    value=0,
    read=0,
    read_point=0,
    valid=0,
    position=0,
    shift=0,
    shift_periods=0,
)
STROBES = "origin_written", "write", "read", "valid", "shift"
SIGNED = "corrected", "moved_by", "error"
FLAGS = "done", "moved", "in_force", "outside", "known"


class Scale:
    """The design with the model beside it in every cycle, and a target that adds every moved_by."""

    def __init__(self, dut):
        self.dut, self.inputs = dut, dict(IDLE)
        self.index = int(dut.INDEX.value)
        self.model = SegmentCorrection(self.index)
        self.target = 0

    async def reset(self, points, origin=0, length=65536):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        await self.give(points, origin, length)
        return self

    async def give(self, points, origin, length):
        for n, value in enumerate(points):
            await self.clk(write=1, point=n, value=value)
        await self.clk(
            segments=len(points) - 1, segment_length=length, origin=origin, origin_written=1
        )

    async def clk(self, count=1, rst=0, **inputs):
        dut, model = self.dut, self.model
        for _ in range(count):
            self.inputs.update(inputs)
            for name, level in self.inputs.items():
                getattr(dut, name).value = level
            dut.rst.value = rst
            self.target = wrap(self.target + (model.moved_by if model.moved else 0))
            model.clk(rst=rst, **self.inputs)
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            for name in FLAGS:
                assert bool(getattr(dut, name).value) == getattr(model, name), (
                    f"{self.inputs}: {name} differs from the model"
                )
            names = SIGNED if model.moved else ("corrected", "error")
            for name in (*names, "stored") if model.known else names:
                got, want = getattr(dut, name).value.to_signed(), getattr(model, name)
                assert got == want, f"{self.inputs}: {name} is {got}, the model has {want}"
            if self.inputs["shift"]:
                self.inputs["position"] = wrap(
                    self.inputs["position"] + (self.inputs["shift_periods"] << 16)
                )
            for name in STROBES:
                self.inputs[name] = 0

    async def at(self, position):
        """Return the corrected position of a scale that stays there, with valid every 5 cycles."""
        for _ in range(2 * (self.model.round // 5 + 3)):
            await self.clk(valid=1, position=position)
            await self.clk(4)
        return self.model.corrected


def any_points(count, reach=(1 << 23) - 1):
    return [random.randint(-reach - 1, reach) for _ in range(count)]


@cocotb.test()
async def the_rectangle_and_the_straight_line_by_hand(dut):
    scale = await Scale(dut).reset([0, 10, 30, -20], origin=500, length=1000)
    await scale.clk(enable=1)
    for position, error in (
        (500, 5),
        (1499, 5),
        (1500, 20),
        (2499, 20),
        (3499, 5),
        (100, 0),
        (9999, -20),
    ):
        assert await scale.at(position) == position - error
    await scale.clk(2, enable=0)
    await scale.clk(enable=1, linear=1)
    for position, error in ((500, 0), (1000, 5), (2000, 20), (3000, 5), (3499, -20)):
        assert await scale.at(position) == position - error


@cocotb.test()
async def the_sign_is_right_in_both_directions(dut):
    count = (1 << int(dut.INDEX.value)) - 1
    scale = await Scale(dut).reset(
        [round(65536 * n / 101) for n in range(count + 1)]
    )  # the scale reads 1 % too much
    await scale.clk(enable=1, linear=1)
    longest = 2 * (scale.model.round + 1 + 8) // 8 + 1  # steps of the motion below
    for direction in (1, -1):
        true = 0 if direction > 0 else count * 64000
        for step in range(600):
            true += direction * 97
            await scale.clk(valid=1, position=true + true // 100)
            await scale.clk(7)
            if step > longest:
                assert abs(scale.model.corrected - true) <= longest * 97 // 100 + 3


@cocotb.test()
async def latency_is_1_and_without_enable_corrected_is_the_position(dut):
    scale = await Scale(dut).reset(any_points(4))
    for _ in range(200):
        position = random.randrange(-1 << 47, 1 << 47)
        await scale.clk(valid=1, position=position)
        assert scale.model.done and scale.model.corrected == position
        await scale.clk(random.randrange(4) or 1)


@cocotb.test()
async def latency_is_index_plus_23_from_enable_to_moved(dut):
    scale = await Scale(dut).reset([1000] * 4)
    await scale.clk(valid=1, position=70000)
    await scale.clk(5)
    clk = 0
    while not scale.model.moved:
        await scale.clk(enable=1)
        clk += 1
    assert clk == scale.index + 23 and scale.model.moved_by == -1000
    await scale.clk()
    assert scale.model.corrected == 69000


@cocotb.test()
async def a_target_that_adds_moved_by_never_sees_a_jump(dut):
    scale = await Scale(dut).reset([4_000_000] * 4, origin=-100_000)  # 61 periods at all borders
    position = 0
    for n in range(40):
        enable = n % 2
        for _ in range(random.randrange(3, 90)):
            moving = random.randrange(3) == 0
            position += 11 * moving
            await scale.clk(
                valid=int(moving or random.randrange(2)), position=position, enable=enable
            )
            scale.target += 11 * moving
            assert scale.target == scale.model.corrected


@cocotb.test()
async def the_error_in_force_belongs_to_a_position_no_older_than_the_header_says(dut):
    scale = await Scale(dut).reset(
        [0, 1 << 22], length=1 << 24
    )  # the error is a quarter of the position
    apart = 7
    await scale.clk(enable=1, linear=1)
    for direction in (300, -300):
        position = (1 << 22) if direction > 0 else 3 << 22
        await scale.at(position)
        allowed = -(-2 * (scale.index + 23 + apart) // apart) * abs(direction) / 4 + 1
        for _ in range(400):
            position += direction
            await scale.clk(valid=1, position=position)
            await scale.clk(apart - 1)
            behind = (position - scale.model.corrected - position / 4) * (
                1 if direction < 0 else -1
            )
            assert -1 <= behind <= allowed


@cocotb.test()
async def a_shift_moves_the_table_with_the_scale_and_latency_is_1_from_shift_to_moved(dut):
    scale = await Scale(dut).reset([0, 7000, -5000, 300], origin=1000, length=65536 + 77)
    await scale.clk(enable=1, linear=1)
    before = await scale.at(80_000)
    for periods in (1, -3, (1 << 31) - 1, -(1 << 31) + 5):
        was = scale.inputs["position"]
        await scale.clk(shift=1, shift_periods=periods)
        assert dut.moved.value and dut.moved_by.value.to_signed() == wrap(periods << 16)
        await scale.clk(2)
        assert scale.model.corrected == wrap(before + (periods << 16))
        before = await scale.at(wrap(was + (periods << 16)))
        assert before == scale.model.corrected == wrap(was + (periods << 16) - scale.model.error)


@cocotb.test()
async def beyond_the_table_the_error_is_that_of_its_border_and_outside_is_high(dut):
    scale = await Scale(dut).reset([100, 200, -300], length=1000)
    await scale.clk(enable=1)
    for position, error, outside in (
        (-5, 100, True),
        (500, 150, False),
        (1500, -50, False),
        (2000, -300, True),
    ):
        assert await scale.at(position) == position - error
        assert scale.model.outside == outside


@cocotb.test()
async def points_are_read_back_with_and_without_enable(dut):
    points = any_points(1 << int(dut.INDEX.value))
    scale = await Scale(dut).reset(points)
    for enable in (0, 1, 0, 1):
        for n in random.sample(range(len(points)), 4):
            await scale.clk(
                random.randrange(1, 40), valid=1, position=random.randrange(1 << 18), enable=enable
            )
            await scale.clk(read=1, read_point=n)
            await scale.clk()
            for _ in range(scale.model.round + 3):
                await scale.clk(valid=1, enable=int(enable and random.randrange(20) > 0))
            assert scale.model.known and scale.model.stored == points[n]


@cocotb.test()
async def reset_in_a_calculation_drops_it(dut):
    scale = await Scale(dut).reset(any_points(4))
    for wait in range(1, scale.model.round + 6, 5):
        await scale.clk(enable=1, valid=1, position=5000)
        await scale.clk(wait, valid=1, position=5100)
        await scale.clk(rst=1, position=0)
        assert not (
            scale.model.in_force or scale.model.done or scale.model.moved or scale.model.known
        )
        await scale.clk(3, enable=0)
        assert scale.model.corrected == 0


@cocotb.test()
async def any_motion_and_any_table_match_the_model(dut):
    scale = await Scale(dut).reset(any_points(1 << int(dut.INDEX.value)))
    most = (1 << scale.index) - 1
    for _ in range(20):
        await scale.clk(2, enable=0)
        count, length = (
            random.randint(1, most),
            random.choice((3, 1000, 1 << 16, random.getrandbits(34) + 1)),
        )
        await scale.give(any_points(count + 1), random.randrange(-1 << 40, 1 << 40), length)
        position = wrap(scale.model.first + random.randrange(-length, (count + 1) * length))
        scale.inputs["position"] = position
        speed, linear = random.randrange(-length, length), random.getrandbits(1)
        for _ in range(300):
            chance = random.random()
            if chance < 0.3:
                scale.inputs["position"] = wrap(scale.inputs["position"] + speed)
                scale.inputs["valid"] = 1
            if chance > 0.97:
                scale.inputs.update(shift=1, shift_periods=random.randrange(-1 << 31, 1 << 31))
            if 0.9 < chance < 0.92:
                scale.inputs.update(read=1, read_point=random.randrange(most + 1))
            await scale.clk(enable=int(random.random() > 0.01), linear=linear)


@pytest.mark.parametrize("index", [3, 8])
def test_segment_correction(index):
    run("segment_correction", __file__, INDEX=index)

# SPDX-License-Identifier: Apache-2.0
"""Tests of position_compare: one pulse per point in both directions, jitter, jumps, both ends of
the settings, and every cycle against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.position_compare import PositionCompare, wrapped

INPUTS = dict(
    start=0,
    step=0,
    count=0,
    pulse_length=1,
    gap_length=1,
    arm=0,
    disarm=0,
    valid=0,
    position=0,
    shift=0,
    shift_periods=0,
)
PERIOD = 1 << 16


class Compare:
    def __init__(self, dut):
        self.dut, self.model, self.settings, self.pulse, self.pulses, self.late = (
            dut,
            PositionCompare(),
            {},
            0,
            0,
            0,
        )

    async def cycle(self, rst=0, **inputs):
        """Advance design and model by one cycle; returns (armed, pulse, late, passed)."""
        dut, values = self.dut, INPUTS | self.settings | inputs
        dut.rst.value = rst
        for name, value in values.items():
            getattr(dut, name).value = value
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        got, want = (
            (
                int(dut.armed.value),
                int(dut.pulse.value),
                int(dut.late.value),
                int(dut.passed.value),
            ),
            self.model.step(rst=rst, **values),
        )
        assert got == want, f"(armed, pulse, late, passed) is {got}, the model has {want}"
        self.pulses, self.pulse, self.late = (
            self.pulses + (got[1] > self.pulse),
            got[1],
            self.late + got[2],
        )
        return got

    async def arm(self, **settings):
        self.settings, self.pulses, self.late = settings, 0, 0
        await self.cycle(arm=1)

    async def ride(self, positions, gap=0):
        """Apply each position for one sample, with `gap` cycles between samples."""
        for position in positions:
            await self.cycle(valid=1, position=position)
            for _ in range(gap):
                await self.cycle(position=position)

    async def idle(self, cycle):
        return [(await self.cycle())[1] for _ in range(cycle)]


async def begin(dut):
    await start(dut, **INPUTS)
    compare = Compare(dut)
    await compare.cycle(rst=1)
    return compare


@cocotb.test()
async def latency_is_3(dut):
    compare = await begin(dut)
    await compare.arm(start=100, step=10)
    await compare.ride([0])
    await compare.idle(5)
    await compare.cycle(valid=1, position=100)
    assert await compare.idle(2) == [0, 1]  # the third clock edge after valid raises it


@cocotb.test()
async def a_pulse_at_each_point_in_both_directions(dut):
    compare = await begin(dut)
    for sign in (1, -1):
        await compare.arm(start=sign * 1000, step=sign * 300, count=5)
        seen = []
        for position in range(900, 3000, 7):
            before = compare.pulses
            await compare.ride([sign * position], 4)
            seen += [position] * (compare.pulses - before)
        assert [0 <= position - (1000 + 300 * k) < 7 for k, position in enumerate(seen)] == [
            True
        ] * 5
        assert await compare.cycle() == (0, 0, 0, 5)


@cocotb.test()
async def the_point_itself_is_reached_and_one_before_it_is_not(dut):
    compare = await begin(dut)
    for sign in (1, -1):
        await compare.arm(start=sign * 50, step=sign * 10, count=1)
        await compare.ride([sign * 49], 8)
        assert compare.pulses == 0
        await compare.ride([sign * 50], 8)
        assert compare.pulses == 1


@cocotb.test()
async def jitter_on_a_point_makes_one_pulse(dut):
    compare = await begin(dut)
    await compare.arm(start=1000, step=500)
    await compare.ride([990])
    await compare.ride([1000 + random.randrange(-400, 400) for _ in range(500)], 2)
    assert compare.pulses == 1
    await compare.ride([1499, 0, 1499, 1500, 1499, 1500], 5)
    assert compare.pulses == 2


@cocotb.test()
async def moving_back_makes_no_pulse(dut):
    compare = await begin(dut)
    await compare.arm(start=0, step=100)
    await compare.ride([*range(-10, 1000, 13), *range(990, -2000, -13), *range(-2000, 900, 13)], 2)
    assert compare.pulses == 10
    await compare.ride([1000], 5)
    assert compare.pulses == 11


@cocotb.test()
async def a_jump_over_many_points_makes_all_their_pulses_in_a_row(dut):
    compare = await begin(dut)
    await compare.arm(start=100, step=10, pulse_length=3, gap_length=2)
    await compare.ride([0], 5)
    await compare.ride([199])
    assert await compare.idle(70) == [0] + [1, 1, 1, 0, 0] * 10 + [0] * 19  # 100, 110 … 190
    assert (compare.pulses, compare.late) == (10, 9)
    # a point that was reached counts, even if it is left at once
    await compare.ride([200, 50, 400, 60], 1)
    await compare.idle(200)
    assert compare.pulses == 31


@cocotb.test()
async def points_behind_the_start_make_no_burst(dut):
    compare = await begin(dut)
    await compare.arm(start=100, step=10)
    await compare.ride([500, 600, 700], 5)
    assert compare.pulses == 0
    await compare.ride([99, 100], 5)
    assert compare.pulses == 1


@cocotb.test()
async def pulse_and_gap_have_their_lengths_and_0_acts_as_1(dut):
    compare = await begin(dut)
    for length, gap in ((0, 0), (1, 1), (0, 5), (7, 0), (40, 3)):
        await compare.arm(start=1, step=1, count=3, pulse_length=length, gap_length=gap)
        await compare.ride([0, 100])
        seen = "".join(map(str, await compare.idle(4 * (length + gap) + 20))).strip("0")
        high, low = max(length, 1), max(gap, 1)
        assert seen == "0".join(["1" * high + "0" * (low - 1)] * 3).strip("0")


@cocotb.test()
async def every_bit_of_the_lengths_counts(dut):
    compare = await begin(dut)
    for bit in range(3, 24):
        for long, short in (("pulse_length", "gap_length"), ("gap_length", "pulse_length")):
            await compare.arm(start=1, step=1, **{long: 2 + (1 << bit), short: 1})
            await compare.ride([0, 100])
            seen = await compare.idle(10)  # the long one lasts until the reset
            assert seen[1:] == [1, *[int(long == "pulse_length")] * 8]
            await compare.cycle(rst=1)


@cocotb.test()
async def every_bit_of_the_point_counts(dut):
    compare = await begin(dut)
    for bit in range(47):
        for first in (1 << bit, -1 << bit):
            for step in (1, -1):
                await compare.arm(start=first, step=step << bit)
                await compare.ride([first + n * step for n in (-2, -1, 0)], 3)
                assert compare.pulses == 1
                await compare.ride([wrapped(first + (step << bit) + n * step) for n in (-1, 0)], 3)
                assert compare.pulses == 2


@cocotb.test()
async def the_count_ends_the_points_and_count_0_has_no_end(dut):
    compare = await begin(dut)
    for count, want in ((1, 1), (7, 7), (0, 200)):
        await compare.arm(start=1, step=5, count=count)
        await compare.ride([0, 1000], 600)
        assert compare.pulses == want and (await compare.cycle())[0] == (count == 0)


@cocotb.test()
async def step_0_is_one_point_passed_upwards(dut):
    compare = await begin(dut)
    await compare.arm(start=10, step=0)
    await compare.ride([20, 5, 10, 5, 10], 5)
    assert compare.pulses == 1 and compare.model.armed is False


@cocotb.test()
async def disarm_ends_the_points_and_the_running_pulse_keeps_its_length(dut):
    compare = await begin(dut)
    await compare.arm(start=10, step=1, pulse_length=9)
    await compare.ride([0, 50], 4)
    await compare.cycle(disarm=1)
    assert sum(await compare.idle(40)) == 5 and compare.pulses == 1


@cocotb.test()
async def arming_again_starts_with_the_first_point(dut):
    compare = await begin(dut)
    await compare.arm(start=10, step=10)
    await compare.ride([0, 25], 8)
    await compare.arm(start=20, step=-10, count=3)
    await compare.ride([30, 15, 5, 0, -40], 8)
    assert compare.pulses == 3


@cocotb.test()
async def a_shift_leaves_the_points_on_the_scale(dut):
    compare = await begin(dut)
    await compare.cycle(shift=1, shift_periods=-12)
    await compare.arm(start=1000, step=1000)
    await compare.ride([0, 999], 5)
    await compare.cycle(shift=1, shift_periods=7)
    await compare.ride([999 + 7 * PERIOD], 5)
    assert compare.pulses == 0
    await compare.cycle(valid=1, position=999 + 7 * PERIOD, shift=1, shift_periods=-1 << 31)
    far = wrapped(7 * PERIOD - (1 << 47))
    await compare.ride([999 + far, 1000 + far, 2000 + far], 5)
    assert compare.pulses == 2


@cocotb.test()
async def a_position_with_arm_is_not_one_since_arm(dut):
    compare = await begin(dut)
    compare.settings = dict(start=1000, step=1000)
    await compare.cycle(arm=1, valid=1, position=999)
    await compare.ride([1000, 1999], 5)
    assert compare.pulses == 0
    await compare.ride([999, 1000], 5)
    assert compare.pulses == 1


@cocotb.test()
async def start_refers_to_the_origin_in_the_cycle_after_arm(dut):
    compare = await begin(dut)
    compare.settings = dict(start=1000, step=1000)
    await compare.cycle(arm=1, valid=1, position=2000, shift=1, shift_periods=3)
    await compare.ride([999], 5)
    assert compare.pulses == 0
    await compare.ride([1000, 1999], 5)
    assert compare.pulses == 1


@cocotb.test()
async def armed_falls_one_cycle_after_the_last_point_is_counted(dut):
    compare = await begin(dut)
    for settings in (dict(step=10, count=1), dict(step=0, count=0)):
        await compare.arm(start=10, **settings)
        await compare.ride([0, 25], 1)
        assert await compare.cycle() == (1, 1, 0, 1)
        assert await compare.cycle() == (0, 0, 0, 1)


@cocotb.test()
async def points_and_position_may_wrap(dut):
    compare, top = await begin(dut), (1 << 47) - 1
    for sign in (1, -1):
        await compare.arm(start=wrapped(sign * (top - 50)), step=sign * 40)
        await compare.ride([wrapped(sign * (top - 60 + n)) for n in range(0, 200, 3)], 3)
        assert compare.pulses == 5


@cocotb.test()
async def pulses_are_the_points_passed_at_any_speed(dut):
    compare = await begin(dut)
    for _ in range(25):
        sign, step, first = (
            random.choice((1, -1)),
            random.choice((1, 7, 1000, 5 * PERIOD)),
            random.randrange(-1000, 1000),
        )
        await compare.arm(start=first, step=sign * step)
        position, farthest = first - sign, first - sign
        for _ in range(60):
            await compare.ride([position], random.randrange(3))
            position += sign * random.randrange(-3 * step, 4 * step + 2) // 3
            farthest = position if sign * (position - farthest) > 0 else farthest
        await compare.ride([position])
        points = sign * (farthest - first) // step + 1
        await compare.idle(2 * points + 10)
        assert compare.pulses == points


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    compare, position = await begin(dut), 0
    for cycle in range(12_000):
        if cycle % 400 == 0:
            compare.settings = dict(
                start=position + random.randrange(-300, 300),
                step=random.randrange(-50, 50),
                count=random.choice((0, 0, 1, 3, 20)),
                pulse_length=random.choice((0, 1, 4)),
                gap_length=random.choice((0, 1, 3)),
            )
        arm, shift, rst = (int(random.random() < share) for share in (0.01, 0.01, 0.002))
        position = wrapped(position + random.randrange(-20, 22))
        periods = random.choice((1, -3, random.randrange(-1 << 31, 1 << 31)))
        await compare.cycle(
            rst,
            arm=arm,
            disarm=int(random.random() < 0.002),
            valid=int(random.random() < 0.6),
            position=position,
            shift=shift and not rst,
            shift_periods=periods,
        )
        if shift and not rst:
            position = wrapped(position + (periods << 16))
            compare.settings["start"] = wrapped(compare.settings["start"] + (periods << 16))
        compare.settings["start"] = wrapped(compare.settings["start"])


def test_position_compare():
    run("position_compare", __file__)

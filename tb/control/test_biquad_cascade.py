# SPDX-License-Identifier: Apache-2.0
"""biquad_cascade: steps by hand, standstill without error, accuracy, bypass, both ends of the
range, and random filters against the model.
"""

import cmath
import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.control.biquad_cascade import HIGH, LOW, PAST, STAGE, BiquadCascade

ONE = 1 << 30
IDLE = dict(
    in_use=0, coefficient_write=0, coefficient_address=0, coefficient=0, valid_in=0, track=0, x=0
)


def with_unity_gain(b0, b1, b2, a1, a2):
    """Rounded coefficients as the block takes them, with a b1 that passes constants unchanged."""
    b0, b2, c1, c2 = (round(value * ONE) for value in (b0, b2, -a1, -a2))
    return b0, ONE - b0 - b2 - c1 - c2, b2, c1, c2


def low_pass(frequency, quality=0.7071):
    """Coefficients of a low-pass at `frequency` of the tick rate, by the bilinear transform."""
    w = 2 * math.pi * frequency
    alpha = math.sin(w) / 2 / quality
    a0, b = 1 + alpha, (1 - math.cos(w)) / 2
    return with_unity_gain(b / a0, 2 * b / a0, b / a0, -2 * math.cos(w) / a0, (1 - alpha) / a0)


def notch(frequency, quality=2.0):
    w = 2 * math.pi * frequency
    alpha = math.sin(w) / 2 / quality
    a0 = 1 + alpha
    return with_unity_gain(
        1 / a0, -2 * math.cos(w) / a0, 1 / a0, -2 * math.cos(w) / a0, (1 - alpha) / a0
    )


class Cascade:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.sections = dut, len(dut.in_use)
        self.model, self.inputs = BiquadCascade(self.sections), dict(IDLE)

    async def reset(self, **inputs):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.inputs.update(inputs)
        return self

    async def clk(self, rst=0, **inputs):
        self.inputs.update(inputs)
        for name, level in dict(self.inputs, rst=rst).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(rst=rst, **self.inputs)
        got = int(self.dut.ready.value), int(self.dut.valid.value), self.dut.y.value.to_signed()
        assert got == want, f"ready, valid, y are {got}, the model has {want}"
        self.inputs.update(coefficient_write=0, valid_in=0, track=0)
        return got

    async def load(self, section, coefficients):
        for number, value in enumerate(coefficients):
            await self.clk(
                coefficient_write=1, coefficient_address=8 * section + number, coefficient=value
            )

    async def sample(self, x, **inputs):
        """Give a sample and return y when the next sample may come."""
        ready, valid, y = await self.clk(valid_in=1, x=x, **inputs)
        out = None
        while not ready:
            ready, valid, y = await self.clk()
            out = y if valid else out
        return out

    async def settle(self, x=0):
        for _ in range(2):
            assert await self.sample(x) == x


@cocotb.test()
async def an_impulse_response_is_as_worked_out_by_hand(dut):
    cascade = await Cascade(dut).reset()
    await cascade.load(0, (ONE // 2, ONE // 4, ONE // 8, ONE // 2, -ONE // 4))
    await cascade.clk(in_use=1)
    await cascade.settle()
    assert [await cascade.sample(x) for x in (800, 0, 0, 0)] == [
        400,
        200 + 200,
        100 + 200 - 100,
        100 - 100,
    ]
    assert await cascade.sample(0) == -50


@cocotb.test()
async def what_is_cut_off_is_added_to_the_next_sample(dut):
    cascade = await Cascade(dut).reset()
    await cascade.load(0, (ONE // 4, 0, 0, 0, 0))
    await cascade.clk(in_use=1)
    await cascade.settle()
    assert [await cascade.sample(x) for x in [3] * 5 + [-3] * 5] == [
        0,
        1,
        1,
        1,
        0,
        0,
        -1,
        -1,
        -1,
        0,
    ]


@cocotb.test()
async def latency_is_sections_times_36_plus_1(dut):
    cascade = await Cascade(dut).reset()
    _, valid, _ = await cascade.clk(valid_in=1, x=5)
    latency = 1
    while not valid:
        _, valid, _ = await cascade.clk()
        latency += 1
    assert latency == 36 * cascade.sections + 1 == STAGE * cascade.sections + 1


@cocotb.test()
async def a_sample_is_taken_every_sections_times_177_plus_1_cycles(dut):
    cascade = await Cascade(dut).reset()
    for _ in range(2):
        ready, _, _ = await cascade.clk(valid_in=1, x=7)
        clk = 1
        while not ready:
            ready, _, y = await cascade.clk(
                valid_in=random.getrandbits(1), x=9
            )  # too early: ignored
            clk += 1
        assert clk == 177 * cascade.sections + 1 == (STAGE + PAST) * cascade.sections + 1 and y == 7


@cocotb.test()
async def it_settles_without_error(dut):
    """Plain rounding would stop up to 1 / (1 + a1 + a2) LSB away, here up to 30 LSB."""
    cascade = await Cascade(dut).reset()
    for section in range(cascade.sections):
        await cascade.load(section, low_pass(0.03 * (section + 1)))
    await cascade.clk(in_use=(1 << cascade.sections) - 1)
    await cascade.settle()
    for x in (1000, -12345):
        out = [await cascade.sample(x) for _ in range(90)]
        assert all(abs(y - x) <= 1 for y in out[-10:]), out[-10:]


@cocotb.test()
async def the_error_is_no_larger_than_the_header_says(dut):
    cascade = await Cascade(dut).reset()
    coefficients = low_pass(0.03, 1.5)
    await cascade.load(0, coefficients)
    await cascade.clk(in_use=1)
    await cascade.settle()
    b0, b1, b2, c1, c2 = (value / ONE for value in coefficients)
    shape, s1, s2 = [], 0.0, 0.0  # impulse response of (1 - z^-1) / A(z)
    for n in range(2000):
        s1, s2 = (n == 0) - (n == 1) + c1 * s1 + c2 * s2, s1
        shape.append(s1)
    low, high = (
        -sum(max(0, s) for s in shape),
        sum(max(0, -s) for s in shape),
    )  # what is cut off counts negative
    x1 = x2 = y1 = y2 = 0.0
    worst = 0.0
    for _ in range(120):
        x = random.randrange(-3000, 3000)
        y = b0 * x + b1 * x1 + b2 * x2 + c1 * y1 + c2 * y2
        x1, x2, y1, y2 = x, x1, y, y1
        error = await cascade.sample(x) - y
        worst = max(worst, abs(error))
        assert low - 1e-6 <= error <= high + 1e-6
    assert worst > 0.5


@cocotb.test()
async def a_notch_removes_its_frequency_and_passes_others(dut):
    cascade = await Cascade(dut).reset()
    await cascade.load(0, notch(0.1))
    await cascade.clk(in_use=1)
    await cascade.settle()

    async def gain(frequency):
        out = [
            await cascade.sample(round(1e6 * math.sin(2 * math.pi * frequency * n)))
            for n in range(90)
        ][50:]
        return (
            abs(sum(y * cmath.exp(-2j * math.pi * frequency * n) for n, y in enumerate(out)))
            * 2
            / len(out)
            / 1e6
        )

    assert await gain(0.1) < 1e-3
    assert (
        abs(await gain(0.05) - 0.9525) < 0.002
    )  # |1 - u^2| / |1 - u^2 + j u / Q|, u = tan(pi f) / tan(pi 0.1)


@cocotb.test()
async def bypass_and_track_pass_x_and_filtering_continues_from_there(dut):
    cascade = await Cascade(dut).reset()
    for section in range(cascade.sections):
        await cascade.load(section, low_pass(0.01))
    await cascade.settle(5000)
    all_of_them = (1 << cascade.sections) - 1
    assert await cascade.sample(5000, in_use=all_of_them) == 5000
    assert abs(await cascade.sample(5000) - 5000) <= 1
    assert abs(await cascade.sample(6000) - 5000) <= 10
    assert await cascade.sample(-7000, track=1) == -7000
    assert await cascade.sample(-7000) == -7000
    assert abs(await cascade.sample(0) + 7000) <= 10
    assert await cascade.sample(300, in_use=0) == 300


@cocotb.test()
async def extreme_coefficients_and_samples_saturate_at_both_ends(dut):
    cascade = await Cascade(dut).reset()
    for ends in (
        (LOW, LOW, LOW, LOW, LOW),
        (HIGH, HIGH, HIGH, HIGH, HIGH),
        (LOW, HIGH, LOW, HIGH, LOW),
    ):
        await cascade.clk(in_use=0)
        for section in range(cascade.sections):
            await cascade.load(section, ends)
        await cascade.sample(0)
        cascade.inputs["in_use"] = (1 << cascade.sections) - 1
        await cascade.settle()
        out = [await cascade.sample(x) for x in (LOW, LOW, LOW, HIGH, HIGH, LOW, HIGH, HIGH, HIGH)]
        assert {LOW, HIGH} & set(out)


@cocotb.test()
async def reset_in_a_sample_drops_it_and_the_past(dut):
    cascade = await Cascade(dut).reset()
    await cascade.load(0, low_pass(0.01))
    await cascade.clk(in_use=1)
    for wait in (0, 1, 2, 34, 35, 36, 37, 100, 170):
        await cascade.settle(4000)
        assert await cascade.sample(0) > 3900
        await cascade.clk(valid_in=1, x=100)
        for _ in range(wait):
            await cascade.clk()
        assert await cascade.clk(rst=1) == (1, 0, 0)
        for _ in range(3):
            assert (await cascade.clk())[1] == 0


@cocotb.test()
async def any_filters_match_the_model(dut):
    cascade = await Cascade(dut).reset()
    word = lambda: random.randrange(LOW, HIGH + 1) >> random.randrange(32)
    for _ in range(8):
        await cascade.clk(in_use=0)
        await cascade.sample(word())
        for section in range(cascade.sections):
            if random.getrandbits(1):
                await cascade.load(
                    section, low_pass(random.uniform(0.001, 0.49), random.uniform(0.3, 9))
                )
            else:
                await cascade.load(section, [word() for _ in range(5)])
        cascade.inputs["in_use"] = random.getrandbits(cascade.sections)
        for _ in range(10):
            await cascade.sample(word(), track=random.randrange(9) == 0)
            for _ in range(random.randrange(3)):
                await cascade.clk()


@pytest.mark.parametrize("sections", [1, 2])
def test_biquad_cascade(sections):
    run("biquad_cascade", __file__, SECTIONS=sections)

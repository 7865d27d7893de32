# SPDX-License-Identifier: Apache-2.0
"""Tests of sample_arbiter: the order, the largest load at which nothing is lost, an overrun, and
random samples against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.interpolate.sample_arbiter import SampleArbiter


class Bench:
    """Design and model, with the sample that each axis holds."""

    def __init__(self, dut):
        self.dut, self.axes, self.w = dut, int(dut.AXES.value), int(dut.W.value)
        self.model, self.held = SampleArbiter(self.axes), [(0, 0)] * self.axes

    async def begin(self):
        await start(self.dut, valid=0, sin=0, cos=0)
        await FallingEdge(self.dut.clk)
        return self

    def draw(self):
        return tuple(random.randrange(-1 << self.w - 1, 1 << self.w - 1) for _ in "sc")

    async def cycle(self, new=(), rst=0):
        """New samples of some axes; returns (the axis that was served, the axes that lost one)."""
        dut, w = self.dut, self.w
        for axis in new:
            self.held[axis] = self.draw()
        dut.valid.value, dut.rst.value = sum(1 << axis for axis in new), rst
        for pins, channel in ((dut.sin, 0), (dut.cos, 1)):
            pins.value = sum(
                (held[channel] % (1 << w)) << w * n for n, held in enumerate(self.held)
            )
        await FallingEdge(dut.clk)
        served, lost = self.model.step(
            [(axis in new, *self.held[axis]) for axis in range(self.axes)], rst
        )
        assert int(dut.done.value) == (served is not None)
        if served:
            assert served == (
                int(dut.axis.value),
                dut.sin_out.value.to_signed(),
                dut.cos_out.value.to_signed(),
            )
        assert int(dut.overrun.value) == sum(1 << axis for axis in lost)
        return served and served[0], lost


@cocotb.test()
async def latency_is_1_and_1_more_for_each_axis_before(dut):
    bench = await Bench(dut).begin()
    for axis in range(bench.axes):
        assert await bench.cycle([axis]) == (axis, set())
    served = [(await bench.cycle(range(bench.axes)))[0]]
    served += [(await bench.cycle())[0] for _ in range(bench.axes)]
    assert served == [*range(bench.axes), None]


@cocotb.test()
async def samples_of_all_axes_at_full_load_are_all_served_in_order(dut):
    bench = await Bench(dut).begin()
    for _ in range(20):
        got = [await bench.cycle(range(bench.axes) if n == 0 else ()) for n in range(bench.axes)]
        assert got == [(axis, set()) for axis in range(bench.axes)]


@cocotb.test()
async def samples_that_are_spaced_at_random_are_never_lost_nor_late(dut):
    bench = await Bench(dut).begin()
    due, since = [0] * bench.axes, [None] * bench.axes
    for cycle in range(3000):
        new = [axis for axis in range(bench.axes) if due[axis] <= cycle]
        for axis in new:
            due[axis] = cycle + bench.axes + random.choice((0, 0, 0, 1, random.randrange(20)))
            since[axis] = cycle
        served, lost = await bench.cycle(new)
        assert not lost
        if served is not None:
            assert cycle - since[served] <= served


@cocotb.test()
async def a_sample_that_comes_too_soon_is_reported_as_an_overrun(dut):
    bench = await Bench(dut).begin()
    assert await bench.cycle([0, 1]) == (0, set())
    assert await bench.cycle([0, 1]) == (0, {1})
    assert await bench.cycle() == (1, set())
    assert await bench.cycle() == (None, set())


@cocotb.test()
async def reset_drops_the_samples_that_wait(dut):
    bench = await Bench(dut).begin()
    await bench.cycle(range(bench.axes))
    assert await bench.cycle(rst=1) == (None, set())
    assert await bench.cycle() == (None, set())


@cocotb.test()
async def any_samples_match_the_model_in_every_cycle(dut):
    bench = await Bench(dut).begin()
    for share in (0.02, 0.1, 0.3, 0.9):
        for _ in range(500):
            new = [axis for axis in range(bench.axes) if random.random() < share]
            await bench.cycle(new, int(random.random() < 0.01))


@pytest.mark.parametrize("axes, w", [(2, 8), (5, 16), (8, 8)])
def test_sample_arbiter(axes, w):
    run("sample_arbiter", __file__, AXES=axes, W=w)

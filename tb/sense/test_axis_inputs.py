# SPDX-License-Identifier: Apache-2.0
"""axis_inputs: each pin to its level, the filter of the limit switches, reset, and random pins
against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start, steady_only
from tb.sense.axis_inputs import PINS, AxisInputs

PERIODS, LIMIT_TICK = 8, 3  # of the filter of a limit switch; cycles between its samples
QUIET = dict.fromkeys(PINS, 0) | dict(drive_fault_n=1)
SYNCHRONISER = 2  # cycles


class Inputs:
    """The design with the model beside it in every cycle; pins keep their levels."""

    def __init__(self, dut):
        self.dut, self.model, self.pins = dut, AxisInputs(), dict(QUIET)
        self.cycle = 0

    async def reset(self):
        await start(self.dut, **self.pins)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 1
        await self.clk(rst=1)
        for _ in range(8):
            await self.clk()
        return self

    async def clk(self, rst=0, **pins):
        self.pins |= pins
        self.cycle += 1
        control = dict(rst=rst, limit_tick=int(self.cycle % LIMIT_TICK == 0))
        for name, level in (self.pins | control).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(**control, **self.pins)
        got = {name: int(getattr(self.dut, name).value) for name in want}
        assert got == want
        return got


@cocotb.test()
async def latency_is_2_and_up_to_8_ticks_more_for_a_limit_switch(dut):
    steady_only("a latency to the cycle")
    for pin, output in PINS.items():
        inputs = await Inputs(dut).reset()
        latency = SYNCHRONISER
        if pin in inputs.model.limits:
            first = -(inputs.cycle + SYNCHRONISER + 1) % LIMIT_TICK  # until a tick sees the level
            latency += 1 + first + (PERIODS - 1) * LIMIT_TICK
        got = await inputs.clk(**{pin: 1 - QUIET[pin]})
        for cycle in range(1, latency + 3):
            assert got[output] == int(cycle >= latency)
            got = await inputs.clk()


@cocotb.test()
async def a_limit_switch_that_bounces_is_filtered(dut):
    steady_only("a filter time to the cycle")
    inputs = await Inputs(dut).reset()
    for _ in range(3):
        for _ in range((PERIODS - 1) * LIMIT_TICK):
            assert not (await inputs.clk(limit_high_open=1))["limit_high"]
        assert not (await inputs.clk(limit_high_open=0))["limit_high"]


@cocotb.test()
async def random_pins_match_the_model(dut):
    inputs = await Inputs(dut).reset()
    for n in range(1500):
        pins = {
            pin: random.getrandbits(2 if pin == "probe" else 1)
            for pin in PINS
            if random.random() < 0.15
        }
        await inputs.clk(rst=int(n % 500 == 400), **pins)


def test_axis_inputs():
    run("axis_inputs", __file__)

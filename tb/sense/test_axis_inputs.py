# SPDX-License-Identifier: Apache-2.0
"""axis_inputs: each pin to its level, the filter of the limit switches, reset, and random pins
against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.axis_inputs import PINS, AxisInputs

LIMIT_CYCLES = 5
QUIET = dict.fromkeys(PINS, 0) | dict(drive_fault_n=1)
SYNCHRONISER = 2  # cycles


class Inputs:
    """The design with the model beside it in every cycle; pins keep their levels."""

    def __init__(self, dut):
        self.dut, self.model, self.pins = dut, AxisInputs(LIMIT_CYCLES), dict(QUIET)

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
        for name, level in (self.pins | dict(rst=rst)).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        want = self.model.clk(rst, **self.pins)
        got = {name: int(getattr(self.dut, name).value) for name in want}
        assert got == want
        return got


@cocotb.test()
async def latency_is_2_and_LIMIT_CYCLES_more_for_a_limit_switch(dut):
    for pin, output in PINS.items():
        inputs = await Inputs(dut).reset()
        latency = SYNCHRONISER + LIMIT_CYCLES * (pin in inputs.model.limits)
        got = await inputs.clk(**{pin: 1 - QUIET[pin]})
        for cycle in range(1, latency + 3):
            assert got[output] == int(cycle >= latency)
            got = await inputs.clk()


@cocotb.test()
async def a_limit_switch_that_bounces_is_filtered(dut):
    inputs = await Inputs(dut).reset()
    for _ in range(3):
        for _ in range(LIMIT_CYCLES - 1):
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
    run("axis_inputs", __file__, LIMIT_CYCLES=LIMIT_CYCLES)

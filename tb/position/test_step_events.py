# SPDX-License-Identifier: Apache-2.0
"""step_events: steps up, down and of nothing, reset in mid-flow, and random steps against the model
in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.position.step_events import StepEvents


class Events:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, StepEvents(int(dut.DELAY.value))

    async def reset(self):
        await start(self.dut, valid=0, step=0)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, valid=0, step=0, rst=0):
        """(stepped, downward) in the cycle of these inputs; downward counts with stepped only."""
        dut = self.dut
        dut.valid.value, dut.step.value, dut.rst.value = valid, step, rst
        await Timer(1, "ns")
        stepped, down = self.model.event(valid, step)
        assert int(dut.stepped.value) == stepped
        assert not stepped or int(dut.downward.value) == down
        await RisingEdge(dut.clk)
        self.model.clk(rst, valid, step)
        await FallingEdge(dut.clk)
        return stepped, down if stepped else 0


@cocotb.test()
async def latency_is_DELAY(dut):
    events = await Events(dut).reset()
    got = [await events.clk(1, step) for step in (16384, -16384, 0)]
    got += [await events.clk() for _ in range(2)]
    delay = events.model.delay
    assert got[delay : delay + 4] == [(1, 0), (1, 1), (0, 0), (0, 0)]


@cocotb.test()
async def reset_drops_a_step(dut):
    events = await Events(dut).reset()
    await events.clk(1, 5, rst=1)
    assert await events.clk() == (0, 0)


@cocotb.test()
async def random_steps_match_the_model(dut):
    events = await Events(dut).reset()
    for _ in range(500):
        step = random.choice((0, 1, -1, random.randrange(-65536, 65536)))
        await events.clk(random.getrandbits(1), step, int(random.random() < 0.02))


@cocotb.test()
async def each_bit_alone_and_each_two_bits_are_a_step(dut):
    events = await Events(dut).reset()
    for high in range(17):
        for low in range(high + 1):
            step = 1 << high | 1 << low
            await events.clk(1, step - (1 << 17 if high == 16 else 0))


@pytest.mark.parametrize("delay", [0, 1])
def test_step_events(delay):
    run("step_events", __file__, DELAY=delay)

# SPDX-License-Identifier: Apache-2.0
"""capture_events: the delay of the index, both sources of software, reset in mid-flow, and random
strobes against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.position.capture_events import CaptureEvents

QUIET = dict(by_counts=0, index_found=0, capture_now=0, sync=0)


class Events:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.delay = dut, int(dut.DELAY.value)
        self.model = CaptureEvents(self.delay)

    async def reset(self):
        await start(self.dut, **QUIET)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        """(index, software) in the cycle of these inputs."""
        inputs = QUIET | inputs
        for name, level in (inputs | dict(rst=rst)).items():
            getattr(self.dut, name).value = level
        await Timer(1, "ns")
        got = int(self.dut.index.value), int(self.dut.software.value)
        assert got == self.model.levels(**inputs)
        await RisingEdge(self.dut.clk)
        self.model.clk(rst, inputs["index_found"])
        await FallingEdge(self.dut.clk)
        return got


@cocotb.test()
async def latency_is_0_with_phases_and_DELAY_with_counts(dut):
    events = await Events(dut).reset()
    assert await events.clk(index_found=1) == (1, 0)
    for _ in range(events.delay + 1):
        assert await events.clk() == (0, 0)
    assert await events.clk(by_counts=1, index_found=1) == (0, 0)
    for cycle in range(1, events.delay + 3):
        assert await events.clk(by_counts=1) == (int(cycle == events.delay), 0)


@cocotb.test()
async def software_and_the_sync_pulse_capture_at_once(dut):
    events = await Events(dut).reset()
    assert await events.clk(capture_now=1) == (0, 1)
    assert await events.clk(sync=1) == (0, 1)
    assert await events.clk() == (0, 0)


@cocotb.test()
async def reset_drops_an_index_on_its_way(dut):
    events = await Events(dut).reset()
    await events.clk(by_counts=1, index_found=1)
    await events.clk(rst=1, by_counts=1)
    for _ in range(events.delay + 1):
        assert await events.clk(by_counts=1) == (0, 0)


@cocotb.test()
async def random_strobes_match_the_model(dut):
    events = await Events(dut).reset()
    for _ in range(500):
        inputs = {name: int(random.random() < 0.3) for name in QUIET}
        await events.clk(rst=int(random.random() < 0.02), **inputs)


@pytest.mark.parametrize("delay", [2, 3])
def test_capture_events(delay):
    run("capture_events", __file__, DELAY=delay)

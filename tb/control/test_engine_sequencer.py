# SPDX-License-Identifier: Apache-2.0
"""engine_sequencer: random conditions against the model in every cycle, ticks and overruns."""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tables.microcode.numbers import ACTIONS
from tb.bench import run, start
from tb.control.engine_sequencer import EngineSequencer


class Sequencer:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, EngineSequencer(int(dut.AXES.value))

    async def reset(self):
        await start(self.dut, tick=0, conditions=0)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, tick=0, conditions=0):
        dut = self.dut
        dut.rst.value, dut.tick.value, dut.conditions.value = rst, tick, conditions
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        want = self.model.clk(rst, tick, conditions)
        got = (
            int(dut.code.value),
            int(dut.action.value),
            int(dut.axis.value),
            int(dut.busy.value),
            int(dut.overrun.value),
        )
        assert got == want, f"line {self.model.line(conditions)}: {got}, the model has {want}"
        return got


@cocotb.test()
async def latency_is_1_from_tick_to_busy(dut):
    sequencer = await Sequencer(dut).reset()
    assert (await sequencer.clk(tick=1))[3:] == (1, 0)
    assert (await sequencer.clk(tick=1))[3:] == (1, 1)
    assert (await sequencer.clk())[3:] == (1, 0)


@cocotb.test()
async def every_axis_is_served_once_in_order(dut):
    sequencer = await Sequencer(dut).reset()
    for _ in range(400):  # until the words of all axes are cleared
        await sequencer.clk()
    for _ in range(5):
        served, busy = [], (await sequencer.clk(tick=1))[3]
        for _ in range(20_000):
            _, action, axis, busy, _ = await sequencer.clk(conditions=random.getrandbits(64))
            if action == ACTIONS["next_axis"] and sequencer.model.ticking:
                served.append(axis)
            if not busy:
                break
        assert served == list(range(sequencer.model.axes)) and not busy


@cocotb.test()
async def random_cycles_match_the_model(dut):
    sequencer = await Sequencer(dut).reset()
    for _ in range(20_000):
        await sequencer.clk(
            rst=int(random.random() < 0.001),
            tick=int(random.random() < 0.002),
            conditions=random.getrandbits(64),
        )


@pytest.mark.parametrize("axes", [1, 3])
def test_engine_sequencer(axes):
    run("engine_sequencer", __file__, AXES=axes)

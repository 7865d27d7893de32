# SPDX-License-Identifier: Apache-2.0
"""step_line: the target of a tick is drawn at the next one, when it restarts the generator, and
random inputs against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.drive.step_line import StepLine

LEVELS = ("enable", "up_in", "down_in")
IDLE = dict.fromkeys((*LEVELS, "tick", "valid", "restart_in", "target_in"), 0)


class Line:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.levels = dut, StepLine(), dict.fromkeys(LEVELS, 0)

    async def reset(self, **levels):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.levels |= levels
        return self

    async def clk(self, rst=0, **inputs):
        """Advance one cycle; returns (go, restart) in it. Levels stay."""
        dut = self.dut
        self.levels |= {k: v for k, v in inputs.items() if k in LEVELS}
        inputs = IDLE | self.levels | inputs
        for name, level in inputs.items():
            getattr(dut, name).value = level
        dut.rst.value = rst
        await Timer(1, "ns")
        want = self.model.line(**inputs)
        assert (int(dut.go.value), int(dut.restart.value)) == want, inputs
        assert dut.target.value.to_signed() == self.model.target
        assert int(dut.target_up.value) == self.model.up
        assert int(dut.target_down.value) == self.model.down
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.model.clk(rst, **inputs)
        return want

    async def tick(self, target=0, restart=0, **levels):
        """A tick and the target that follows it; returns what the tick reported and the target to
        which it led.
        """
        led_to = self.model.target
        got = await self.clk(tick=1, **levels)
        await self.clk()
        await self.clk(valid=1, target_in=target, restart_in=restart)
        await self.clk()
        return {(1, 0): "go", (0, 1): "restart", (0, 0): None}[got], led_to


@cocotb.test()
async def latency_is_0_from_the_tick_after_the_one_of_the_target(dut):
    line = await Line(dut).reset(enable=1)
    assert await line.tick(5, restart=1) == (None, 0)
    assert await line.tick(7) == ("restart", 5)
    assert await line.tick(-9) == ("go", 7)
    assert await line.tick(11) == ("go", -9)
    assert await line.tick(12, restart=1) == ("go", 11)
    assert await line.tick(13) == ("restart", 12)


@cocotb.test()
async def it_restarts_with_the_drive_on_whenever_it_was_off(dut):
    line = await Line(dut).reset(enable=1)
    await line.tick(1)
    await line.tick(2)
    assert await line.tick(3, enable=0) == ("restart", 2)
    assert await line.tick(4, enable=0) == ("restart", 3)
    assert await line.tick(5, enable=1) == ("restart", 4)
    assert await line.tick(6) == ("go", 5)
    await line.clk(tick=1)
    await line.clk(enable=0)  # between the tick and its target
    await line.clk(enable=1, valid=1, target_in=7)
    assert await line.tick(8) == ("restart", 7)
    assert await line.tick(9) == ("go", 8)


@cocotb.test()
async def the_direction_is_that_of_the_line(dut):
    line = await Line(dut).reset(enable=1)
    await line.tick(1, up_in=1)
    await line.clk(up_in=0, down_in=1)
    assert (int(dut.target_up.value), int(dut.target_down.value)) == (1, 0)
    await line.tick(2)
    assert (int(dut.target_up.value), int(dut.target_down.value)) == (0, 1)


@cocotb.test()
async def random_inputs_match_the_model(dut):
    line = await Line(dut).reset()
    for _ in range(4000):
        await line.clk(
            rst=int(random.random() < 0.005),
            enable=int(random.random() < 0.9),
            tick=int(random.random() < 0.2),
            valid=int(random.random() < 0.2),
            restart_in=int(random.random() < 0.2),
            target_in=random.getrandbits(48) - (1 << 47),
            up_in=random.getrandbits(1),
            down_in=random.getrandbits(1),
        )


def test_step_line():
    run("step_line", __file__)

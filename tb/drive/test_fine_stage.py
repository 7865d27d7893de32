# SPDX-License-Identifier: Apache-2.0
"""fine_stage: holding, the return to the middle, both limits, the drive off, and random ticks
against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.fine_stage import RETURN, FineStage

LATENCY = 134  # cycles from tick to command
INPUTS = dict(enable=1, hold=1, kp=1 << 16, ki=0, kd=0, limit=1000, target=0, position=0)


class Stage:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, FineStage(), dict(INPUTS)

    async def reset(self):
        await start(self.dut, tick=0, gains_changed=0, **self.inputs)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, **strobes):
        strobes = dict(rst=0, tick=0, gains_changed=0) | strobes
        for name, level in (self.inputs | strobes).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got = (
            int(self.dut.valid.value),
            self.dut.command.value.to_signed(),
            int(self.dut.saturated.value),
        )
        assert got == self.model.clk(**self.inputs, **strobes)
        return got

    async def tick(self, **inputs):
        self.inputs.update(inputs)
        got = await self.clk(tick=1)
        while not got[0]:
            got = await self.clk()
        return got[1:]


@cocotb.test()
async def latency_is_134(dut):
    stage = await Stage(dut).reset()
    await stage.tick()
    valid, cycles = (await stage.clk(tick=1))[0], 1
    while not valid:
        valid, cycles = (await stage.clk())[0], cycles + 1
    assert cycles == LATENCY


@cocotb.test()
async def it_holds_with_its_gain_and_reports_both_limits(dut):
    stage = await Stage(dut).reset()
    for _ in range(3):
        await stage.tick()
    assert await stage.tick(target=300) == (300, 0)
    assert await stage.tick(target=1000) == (1000, 1)
    assert await stage.tick(target=-5000) == (-1000, 1)


@cocotb.test()
async def it_returns_to_the_middle_slowly_and_drops_to_it_without_the_drive(dut):
    stage = await Stage(dut).reset()
    for _ in range(3):
        command, _ = await stage.tick(target=100)
    assert command == 100
    for want in (100 - RETURN, 100 - 2 * RETURN):
        assert await stage.tick(hold=0) == (want, 0)
    for _ in range(10):
        command, _ = await stage.tick()
    assert command == 0
    await stage.tick(hold=1, target=-500)
    await stage.tick()
    assert await stage.tick(enable=0) == (0, 0)


@cocotb.test()
async def random_ticks_and_a_reset_in_mid_flow_match_the_model(dut):
    stage = await Stage(dut).reset()
    for n in range(150):
        await stage.tick(
            target=random.randrange(-3000, 3000),
            position=random.randrange(-3000, 3000),
            enable=int(random.random() < 0.9),
            hold=int(random.random() < 0.6),
        )
        if n % 20 == 10:
            gains = dict(kp=18, ki=20, kd=20)
            stage.inputs.update({name: random.getrandbits(n) for name, n in gains.items()})
            await stage.clk(gains_changed=1)
        if n % 50 == 40:
            await stage.clk(tick=1)
            for _ in range(random.randrange(LATENCY)):
                await stage.clk()
            await stage.clk(rst=1)


def test_fine_stage():
    run("fine_stage", __file__)

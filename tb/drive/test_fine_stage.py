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
async def each_bit_of_the_gains_and_of_the_limit_acts(dut):
    stage = await Stage(dut).reset()
    for gain, point, want in (("kp", 16, 256), ("ki", 24, 64), ("kd", 16, 256)):
        for n in range(24):
            await stage.clk(rst=1)
            stage.inputs |= dict(INPUTS, kp=0) | {gain: 1 << n}
            await stage.clk(gains_changed=1)
            for _ in range(3):
                await stage.tick()
            assert await stage.tick(target=(want << point) >> n) == (want, 0), (gain, n)
    for n in range(15):
        await stage.clk(rst=1)
        stage.inputs |= dict(INPUTS, limit=1 << n)
        for _ in range(3):
            await stage.tick()
        assert await stage.tick(target=1 << 20) == (1 << n, 1)


@cocotb.test()
async def random_ticks_and_a_reset_in_mid_flow_match_the_model(dut):
    stage = await Stage(dut).reset()
    middle = 0
    for n in range(300):
        reach = 1 << random.randrange(8, 32)
        await stage.tick(
            target=middle + random.randrange(-reach, reach),
            position=middle + random.randrange(-3000, 3000),
            limit=random.choice([1000, random.getrandbits(15)]),
            enable=int(random.random() < 0.9),
            hold=int(random.random() < 0.6),
        )
        if n % 20 == 10:
            middle = random.randrange(-(1 << 46), 1 << 46)
            gains = {name: random.getrandbits(random.randrange(25)) for name in ("kp", "ki", "kd")}
            stage.inputs.update(gains)
            await stage.clk(gains_changed=1)
        if n % 50 == 40:
            await stage.clk(tick=1)
            for _ in range(random.randrange(LATENCY)):
                await stage.clk()
            await stage.clk(rst=1)


def test_fine_stage():
    run("fine_stage", __file__)

# SPDX-License-Identifier: Apache-2.0
"""override_ramp: by hand, its limits, settings that change on the way, and random events against the model."""
import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from bench import run, start
from override_ramp import FULL, OverrideRamp

NAMES = "rst", "slope", "curve", "percent", "pause", "moving", "tick"


class Ramp:
    def __init__(self, dut):
        self.dut, self.model, self.clk_count = dut, OverrideRamp(), 0
        self.settings = dict(slope=0, curve=0, percent=65536, pause=0, moving=1)

    async def reset(self):
        await start(self.dut, **self.settings, tick=0)
        await FallingEdge(self.dut.clk)
        self.model.clk(rst=1)
        self.rate = FULL
        return self

    async def clk(self, **events):
        given = self.settings | events
        for name in NAMES:
            getattr(self.dut, name).value = given.get(name, 0)
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.clk_count += 1
        want, self.rate = self.model.clk(**given), int(self.dut.rate.value)
        assert self.rate == want, f"clk {self.clk_count}, {given}: {self.rate}, the model has {want}"

    async def tick(self):
        await self.clk(tick=1)
        await self.clk()
        return self.rate

    async def until(self, setting, most=2000):
        """The rates on the way."""
        rates = [self.rate]
        while rates[-1] != setting:
            rates.append(await self.tick())
            assert len(rates) < most
        return rates


@cocotb.test()
async def by_hand(dut):
    ramp = await Ramp(dut).reset()
    ramp.settings |= dict(slope=1 << 29, curve=1 << 28, percent=0)
    eighths = [rate * 16 / FULL for rate in await ramp.until(0)]
    assert eighths == [16, 15, 13, 11, 9, 7, 5, 3, 1, 0]


@cocotb.test()
async def latency_is_2(dut):
    ramp = await Ramp(dut).reset()
    ramp.settings |= dict(slope=1 << 29, curve=1 << 29, percent=0)
    await ramp.clk(tick=1)
    assert ramp.rate == FULL
    await ramp.clk()
    assert ramp.rate == FULL - (1 << 29)


@cocotb.test()
async def every_ramp_keeps_slope_and_curve_and_ends_at_the_setting(dut):
    ramp = await Ramp(dut).reset()
    for _ in range(40):
        slope = int(2 ** random.uniform(25, 31))
        curve = int(slope * 2 ** random.uniform(-6, 0.5))
        percent, pause = random.choice((0, 1, 65535, 65536, 131071, random.randrange(65536))), random.randrange(2)
        ramp.settings |= dict(slope=slope, curve=curve, percent=percent, pause=pause)
        setting = 0 if pause else min(percent, 65536) << 16
        rates = await ramp.until(setting)
        if random.randrange(2):                             # where it stops it stays
            assert await ramp.tick() == setting
        paces = [0, *(b - a for a, b in zip(rates, rates[1:])), 0]
        assert max(map(abs, paces)) <= slope
        assert all(abs(b - a) <= min(curve, slope) for a, b in zip(paces, paces[1:]))


@cocotb.test()
async def a_setting_that_changes_on_the_way_makes_no_jump(dut):
    ramp = await Ramp(dut).reset()
    slope, curve = 1 << 27, 1 << 23
    ramp.settings |= dict(slope=slope, curve=curve)
    rates = [FULL, FULL]
    for _ in range(40):
        ramp.settings |= dict(percent=random.randrange(65537), pause=int(random.randrange(4) == 0))
        rates += [await ramp.tick() for _ in range(random.randrange(1, 40))]
    paces = [b - a for a, b in zip(rates, rates[1:])]
    assert max(map(abs, paces)) <= slope and all(abs(b - a) <= curve for a, b in zip(paces, paces[1:]))


@cocotb.test()
async def while_nothing_moves_or_without_a_slope_it_is_there_at_once(dut):
    ramp = await Ramp(dut).reset()
    for settings in (dict(moving=0, slope=1), dict(moving=1, slope=0)):
        for percent in (0, 1, 65535, 65536, 65537, 131071):
            ramp.settings |= settings | dict(percent=percent)
            await ramp.clk()
            assert ramp.rate == min(percent, 65536) << 16


@cocotb.test()
async def reset_in_mid_flow(dut):
    ramp = await Ramp(dut).reset()
    for wait in range(4):
        ramp.settings |= dict(slope=1 << 20, curve=1 << 18, percent=0)
        await ramp.tick()
        await ramp.clk(tick=1)
        for _ in range(wait):
            await ramp.clk()
        await ramp.clk(rst=1)
        assert ramp.rate == FULL
    assert await ramp.tick() == FULL - (1 << 18)


@cocotb.test()
async def any_events_match_the_model(dut):
    ramp = await Ramp(dut).reset()
    word = lambda bits: random.getrandbits(bits) >> random.randrange(bits + 1)
    gap = 0
    for _ in range(20000):
        gap -= 1
        if random.randrange(60) == 0:
            ramp.settings |= dict(slope=word(32), curve=word(32), percent=word(17), pause=int(random.randrange(4) == 0),
                                  moving=int(random.randrange(8) > 0))
        tick = int(gap <= 0 and random.randrange(2))
        if tick:
            gap = random.randrange(2, 5)
        await ramp.clk(tick=tick, rst=int(random.randrange(2000) == 0))


def test_override_ramp():
    run("override_ramp", __file__)

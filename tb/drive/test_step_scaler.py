# SPDX-License-Identifier: Apache-2.0
"""step_scaler: products by hand, both ends of the ranges, and random positions against the model in
every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.step_scaler import LATENCY, StepScaler

IDLE = dict(ratio=0, valid=0, position=0)
ONE = 1 << 32  # a step per period


class Scaler:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, StepScaler()

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        inputs = dict(IDLE, rst=rst) | inputs
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got, want = (
            (int(self.dut.done.value), self.dut.steps.value.to_signed()),
            self.model.clk(**inputs),
        )
        assert got == want, f"{inputs}: done, steps are {got}, the model has {want}"
        return got

    async def scale(self, position, ratio):
        """(steps, cycles that it took); the other inputs change after the first cycle."""
        done, latency = await self.clk(valid=1, position=position, ratio=ratio), 1
        while not done[0]:
            done = await self.clk(position=random.getrandbits(40), ratio=random.getrandbits(40))
            latency += 1
        return done[1], latency


@cocotb.test()
async def steps_are_the_floor_of_products_worked_out_by_hand(dut):
    scaler = await Scaler(dut).reset()
    for position, ratio, steps in (
        (3 << 16, ONE, 3 << 16),
        (5 << 16, 5 * ONE // 2, 25 << 15),
        (-3, ONE // 2, -2),
        (3, -ONE // 2, -2),
        (1, ONE - 1, 0),
        (-1, 1, -1),
        (-7, -ONE, 7),
        (0, -1, 0),
    ):
        assert (await scaler.scale(position, ratio))[0] == steps


@cocotb.test()
async def latency_is_49(dut):
    scaler = await Scaler(dut).reset()
    assert LATENCY == 49 == (await scaler.scale(1 << 16, ONE))[1] == (await scaler.scale(-1, -1))[1]


@cocotb.test()
async def the_ends_of_both_ranges_are_scaled_modulo_2_48(dut):
    scaler = await Scaler(dut).reset()
    ends = (-(2**47), 2**47 - 1, -1, 0, 1)
    for position in ends:
        for ratio in (*ends, ONE, -ONE):
            steps, _ = await scaler.scale(position, ratio)
            assert (steps - (position * ratio >> 32)) % 2**48 == 0


@cocotb.test()
async def a_position_that_comes_too_soon_is_ignored(dut):
    scaler = await Scaler(dut).reset()
    for soon in range(1, LATENCY):
        await scaler.clk(valid=1, position=1 << 16, ratio=ONE)
        for clk in range(1, LATENCY):
            got = await scaler.clk(valid=clk == soon, position=9 << 16, ratio=ONE)
        assert got == (1, 1 << 16)


@cocotb.test()
async def reset_in_a_product_drops_it(dut):
    scaler = await Scaler(dut).reset()
    for wait in range(0, 52, 3):
        await scaler.clk(valid=1, position=5 << 16, ratio=ONE)
        for _ in range(wait):
            await scaler.clk()
        assert await scaler.clk(rst=1) == (0, 0)
        assert {await scaler.clk() for _ in range(60)} == {(0, 0)}


@cocotb.test()
async def any_positions_match_the_model(dut):
    scaler = await Scaler(dut).reset()
    for _ in range(8000):
        await scaler.clk(
            rst=int(random.randrange(1000) == 0),
            valid=int(random.randrange(20) == 0),
            position=random.randrange(-(2**47), 2**47) >> random.randrange(47),
            ratio=random.randrange(-(2**47), 2**47) >> random.randrange(47),
        )


def test_step_scaler():
    run("step_scaler", __file__)

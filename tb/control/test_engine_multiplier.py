# SPDX-License-Identifier: Apache-2.0
"""engine_multiplier: products of the ends of the range, and random ones, against the model."""

import random

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tb.bench import run
from tb.control.engine_multiplier import EngineMultiplier

TOP = (1 << 34) - 1
ENDS = (-TOP - 1, -TOP, -1, 0, 1, TOP, (1 << 17) - 1, 1 << 17, -(1 << 17), -(1 << 17) - 1)


class Multiplier:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, EngineMultiplier()

    async def clk(self, x, y):
        self.dut.x.value, self.dut.y.value = x, y
        want = self.model.clk(x, y)
        await FallingEdge(self.dut.clk)
        got = self.dut.product.value.to_signed()
        assert got == want, f"{x} * {y}: {got}, the model has {want}"
        return got


async def begin(dut):
    Clock(dut.clk, 10, "ns", impl="gpi").start()
    await FallingEdge(dut.clk)
    return Multiplier(dut)


@cocotb.test()
async def latency_is_1_and_a_new_product_comes_in_each_cycle(dut):
    multiplier = await begin(dut)
    assert await multiplier.clk(3, -5) == -15
    assert await multiplier.clk(-(1 << 34), -(1 << 34)) == 1 << 68


@cocotb.test()
async def the_ends_of_the_range_and_of_the_halves_match_the_model(dut):
    multiplier = await begin(dut)
    for x in ENDS:
        for y in ENDS:
            await multiplier.clk(x, y)


@cocotb.test()
async def random_products_match_the_model(dut):
    multiplier = await begin(dut)
    for _ in range(3000):
        await multiplier.clk(
            *(random.randrange(-TOP - 1, TOP + 1) >> random.randrange(34) for _ in "xy")
        )


def test_engine_multiplier():
    run("engine_multiplier", __file__)

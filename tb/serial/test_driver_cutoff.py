# SPDX-License-Identifier: Apache-2.0
"""driver_cutoff: to the clk, at both ends of the bit time, how long it lasts, and noise against the model."""
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.serial.driver_cutoff import DriverCutoff


class Cutoff:
    def __init__(self, dut):
        self.dut, self.bits = dut, int(dut.BITS.value)
        self.model = DriverCutoff(self.bits)

    async def begin(self):
        await start(self.dut, wanted=0, bit_time=0)
        await self.clk(0, 0, rst=1)
        return self

    async def clk(self, wanted, bit_time, rst=0):
        self.dut.wanted.value, self.dut.bit_time.value, self.dut.rst.value = wanted, bit_time, rst
        await FallingEdge(self.dut.clk)
        got = int(self.dut.driver_enable.value), int(self.dut.cut.value)
        assert got == self.model.step(wanted, bit_time, rst)
        return got


@cocotb.test()
async def it_cuts_off_after_its_bit_times_to_the_clk_and_once(dut):
    cutoff = await Cutoff(dut).begin()
    for bit_time, clk in ((0, 8), (127, 8), (128, 8), (160, 10)):
        seen = [await cutoff.clk(1, bit_time) for _ in range(2 * cutoff.bits * clk)]
        assert [on for on, _ in seen].index(0) == cutoff.bits * clk and seen.index((0, 1)) == cutoff.bits * clk
        assert sum(on for on, _ in seen) == cutoff.bits * clk and sum(cut for _, cut in seen) == 1
        assert await cutoff.clk(0, bit_time) == (0, 0)
        assert await cutoff.clk(1, bit_time) == (1, 0)
        await cutoff.clk(0, bit_time)


@cocotb.test()
async def a_reply_that_ends_in_time_is_not_touched(dut):
    cutoff = await Cutoff(dut).begin()
    for _ in range(3):
        assert set([await cutoff.clk(1, 128) for _ in range(cutoff.bits * 8)]) == {(1, 0)}
        assert await cutoff.clk(0, 128) == (0, 0)


@cocotb.test()
async def the_longest_bit_time_does_not_overflow(dut):
    cutoff = await Cutoff(dut).begin()
    assert set([await cutoff.clk(1, 0xFFFFF) for _ in range(5000)]) == {(1, 0)}


@cocotb.test()
async def noise_matches_the_model(dut):
    cutoff = await Cutoff(dut).begin()
    for _ in range(200):
        wanted, bit_time = random.getrandbits(1), random.choice([0, 128, 133])
        for _ in range(random.choice([1, 10, 8 * cutoff.bits - 1, 8 * cutoff.bits + 2])):
            await cutoff.clk(wanted, bit_time, random.random() < 0.001)


@pytest.mark.parametrize("bits", [16, 64])
def test_driver_cutoff(bits):
    run("driver_cutoff", __file__, BITS=bits)

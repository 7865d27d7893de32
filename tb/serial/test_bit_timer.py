# SPDX-License-Identifier: Apache-2.0
"""bit_timer: the cycle of every tick at short, long and odd bit times, and random restarts against
the model.
"""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tb.bench import run
from tb.serial.bit_timer import BitTimer


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, BitTimer(int(dut.PARTS.value))
        self.one = self.model.one  # a cycle, in the unit of a part of a bit

    async def begin(self, bit_time):
        Clock(self.dut.clk, 10, "ns").start()
        self.dut.bit_time.value, self.dut.restart.value = bit_time, 1
        await FallingEdge(self.dut.clk)
        self.model.step(bit_time, 1)
        return self

    async def clk(self, bit_time, restart=0):
        self.dut.bit_time.value, self.dut.restart.value = bit_time, restart
        await FallingEdge(self.dut.clk)
        self.model.step(bit_time, restart)
        tick = int(self.dut.tick.value)
        assert tick == self.model.tick(bit_time)
        return tick


async def ticks(bench, bit_time, cycles):
    """The cycles of the ticks after a restart; its last cycle is cycle 0."""
    await bench.clk(bit_time, 1)
    first = int(bench.dut.tick.value)
    return [1] * first + [n + 2 for n in range(cycles) if await bench.clk(bit_time)]


@cocotb.test()
async def latency_is_n_parts_of_the_bit_time_rounded_or_1_less(dut):
    bench = await Bench(dut).begin(128)
    one = bench.one
    for bit_time in (128, 133, 255, 256, 271, 555, 4095, 8333):
        found = await ticks(bench, bit_time, 60 * bit_time // one)
        assert len(found) > 40
        for n, cycle in enumerate(found, 1):
            assert 0 <= (n * bit_time + one // 2) // one - cycle <= 1
            assert bit_time % one or one * cycle == n * bit_time


@cocotb.test()
async def less_than_a_cycle_per_part_counts_as_a_cycle_more(dut):
    bench = await Bench(dut).begin(0)
    half, more = bench.one // 2, bench.one * 3 // 2
    assert await ticks(bench, 0, 30) == list(range(1, 32))
    assert await ticks(bench, half, 31) == await ticks(bench, more, 31)


@cocotb.test()
async def the_longest_bit_is_timed_as_any_other(dut):
    bench = await Bench(dut).begin(0xFFFFF)
    part = 0xFFFFF // bench.one
    assert await ticks(bench, 0xFFFFF, 3 * part + 27) == [part, 2 * part + 1, 3 * part + 2]


@cocotb.test()
async def any_bit_of_a_long_bit_time_counts(dut):
    bench = await Bench(dut).begin(0)
    for bit_time in (0xAAAAA, 0x55555, *(1 << n for n in range(7, 20))):
        part = bit_time // bench.one
        assert (await ticks(bench, bit_time, part + 2))[0] == part


@cocotb.test()
async def random_restarts_match_the_model(dut):
    bench = await Bench(dut).begin(128)
    for _ in range(60):
        bit_time = random.choice([0, 64, 80, 128, 133, random.randrange(2048)])
        await bench.clk(bit_time, 1)
        for _ in range(random.randrange(80)):
            await bench.clk(bit_time, int(random.random() < 0.02))


@pytest.mark.parametrize("parts", [8, 4])
def test_bit_timer(parts):
    run("bit_timer", __file__, PARTS=parts)

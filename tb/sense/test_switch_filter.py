# SPDX-License-Identifier: Apache-2.0
"""Tests of switch_filter: the time at both ends of its range, bounce, the start-up, and random
levels against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.switch_filter import SwitchFilter


class Bench:
    """The design and its model side by side; a sample every `period` cycles."""

    @classmethod
    async def begin(cls, dut, period=5, levels=0, started=True):
        bench = cls()
        bench.dut, bench.period, bench.cycle = dut, period, 0
        bench.switches, bench.periods = int(dut.W.value), int(dut.PERIODS.value)
        bench.model = SwitchFilter(bench.switches, bench.periods, int(dut.SETTLE.value))
        bench.levels = levels
        await start(dut, level=levels, sample=0)
        bench.model.step(bench.bits(), 0, 1)
        for _ in range(int(dut.SETTLE.value) * started):
            await bench.clk(sample=0)
        return bench

    def bits(self):
        return [self.levels >> n & 1 for n in range(self.switches)]

    async def clk(self, levels=None, sample=None, rst=0):
        """The filtered levels after one cycle."""
        dut = self.dut
        if levels is not None:
            self.levels = levels
        if sample is None:
            self.cycle += 1
            sample = int(self.cycle % self.period == 0)
        dut.level.value, dut.sample.value, dut.rst.value = self.levels, sample, rst
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        want = sum(bit << n for n, bit in enumerate(self.model.step(self.bits(), sample, rst)))
        assert int(dut.filtered.value) == want, f"cycle {self.cycle}"
        return want


@cocotb.test()
async def latency_is_between_periods_less_1_and_periods_of_sample(dut):
    for phase in range(5):
        bench = await Bench.begin(dut)
        for _ in range(phase):
            await bench.clk()
        cycles = 1
        while not await bench.clk(1) & 1:
            cycles += 1
        assert cycles == bench.periods * 5 - phase


@cocotb.test()
async def a_return_of_one_cycle_between_two_samples_begins_the_time_again(dut):
    bench = await Bench.begin(dut, period=6)
    for _ in range(4):
        for _ in range(6 * (bench.periods - 2)):
            assert not await bench.clk(1)
        assert not await bench.clk(0)
        while bench.cycle % 6:
            assert not await bench.clk(1)


@cocotb.test()
async def without_samples_nothing_changes(dut):
    bench = await Bench.begin(dut)
    for _ in range(100):
        assert await bench.clk(1, sample=0) == 0


@cocotb.test()
async def levels_that_are_high_from_power_up_make_no_edge(dut):
    both = (1 << int(dut.W.value)) - 1
    bench = await Bench.begin(dut, levels=both, started=False)
    for _ in range(100):
        assert await bench.clk() == both


@cocotb.test()
async def a_reset_in_the_time_of_a_level_takes_it_at_once(dut):
    bench = await Bench.begin(dut)
    for _ in range(5 * bench.periods - 5):
        assert await bench.clk(1) == 0
    assert await bench.clk(rst=1) == 1


@cocotb.test()
async def random_levels_and_resets_match_the_model(dut):
    for period in (1, 2, 7):
        bench = await Bench.begin(dut, period)
        for _ in range(200):
            levels = random.getrandbits(bench.switches)
            for _ in range(random.choice([1, 3, period * bench.periods, 80])):
                await bench.clk(levels, sample=random.choice([None, None, None, 0]))
            if random.random() < 0.05:
                await bench.clk(rst=1)


@pytest.mark.parametrize("switches, periods", [(2, 8), (1, 3)])
def test_switch_filter(switches, periods):
    run("switch_filter", __file__, W=switches, PERIODS=periods)

# SPDX-License-Identifier: Apache-2.0
"""break_detector: the exact cycle, lows that are too short, one report per break, and noise against
the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.serial.break_detector import BreakDetector

CLK_HZ, TIME_US = 1_000_000, 43
LONGEST = 43  # cycles, TIME_US at CLK_HZ; not divisible by 2, so that each bit of a count matters


class Detector:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, BreakDetector(CLK_HZ, TIME_US)

    async def begin(self):
        await start(self.dut, rx=1)
        await self.clk(1, rst=1)
        return self

    async def clk(self, rx, rst=0):
        self.dut.rx.value, self.dut.rst.value = rx, rst
        await FallingEdge(self.dut.clk)
        found = int(self.dut.found.value)
        assert found == self.model.step(rx, rst)
        return found


@cocotb.test()
async def latency_is_time_us_in_cycles_and_a_break_is_reported_once(dut):
    detector = await Detector(dut).begin()
    for _ in range(2):
        found = [await detector.clk(0) for _ in range(5 * LONGEST)]
        assert found.index(1) == LONGEST - 1 and sum(found) == 1
        assert not await detector.clk(1)


@cocotb.test()
async def a_low_that_is_one_cycle_shorter_is_no_break(dut):
    detector = await Detector(dut).begin()
    for _ in range(5):
        assert not any(
            [await detector.clk(0) for _ in range(LONGEST - 1)] + [await detector.clk(1)]
        )


@cocotb.test()
async def after_a_reset_in_a_break_its_time_counts_from_the_start(dut):
    detector = await Detector(dut).begin()
    for _ in range(LONGEST - 1):
        await detector.clk(0)
    assert not await detector.clk(0, rst=1)
    found = [await detector.clk(0) for _ in range(LONGEST)]
    assert found.index(1) == LONGEST - 1


@cocotb.test()
async def noise_matches_the_model(dut):
    detector = await Detector(dut).begin()
    for _ in range(300):
        level = random.getrandbits(1)
        for _ in range(random.choice([1, 5, LONGEST - 1, LONGEST, LONGEST + 1, 2 * LONGEST])):
            await detector.clk(level, random.random() < 0.002)


def test_break_detector():
    run("break_detector", __file__, CLK_HZ=CLK_HZ, TIME_US=TIME_US)

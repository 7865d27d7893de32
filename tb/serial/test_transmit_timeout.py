# SPDX-License-Identifier: Apache-2.0
"""transmit_timeout: the exact tick, that the driver stays off, and noise against the model."""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.serial.transmit_timeout import TransmitTimeout


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.ticks = dut, 8 * int(dut.BITS.value)
        self.model = TransmitTimeout(int(dut.BITS.value))

    async def begin(self):
        await start(self.dut, requested=0, tick=0)
        await self.clk(0, 0, rst=1)
        return self

    async def clk(self, requested, tick, rst=0):
        d = self.dut
        d.requested.value, d.tick.value, d.rst.value = requested, tick, rst
        await FallingEdge(d.clk)
        got = int(d.driver_enable.value), int(d.expired.value)
        assert got == self.model.step(requested, tick, rst)
        return got


@cocotb.test()
async def the_driver_is_switched_off_once_after_exactly_bits_bit_times(dut):
    timeout = await Bench(dut).begin()
    for gap in (1, 3):  # cycles between the ticks
        seen = [await timeout.clk(1, n % gap == 0) for n in range(2 * timeout.ticks * gap)]
        last = (timeout.ticks - 1) * gap
        assert [on for on, _ in seen].index(0) == last == seen.index((0, 1))
        assert sum(on for on, _ in seen) == last and sum(expired for _, expired in seen) == 1
        assert await timeout.clk(0, 1) == (0, 0)
        assert await timeout.clk(1, 1) == (1, 0)
        await timeout.clk(0, 1)


@cocotb.test()
async def latency_is_0_from_requested_to_driver_enable(dut):
    await Bench(dut).begin()
    for requested in (1, 0, 1):
        dut.requested.value = requested
        await Timer(1, "ns")  # much less than a cycle
        assert int(dut.driver_enable.value) == requested


@cocotb.test()
async def latency_is_1_from_the_last_tick_to_expired(dut):
    timeout = await Bench(dut).begin()
    for cycle in range(timeout.ticks - 1):
        assert await timeout.clk(1, 1) == (1, 0), cycle
    assert await timeout.clk(1, 0) == (1, 0)
    assert await timeout.clk(1, 1) == (0, 1)
    assert await timeout.clk(1, 1) == (0, 0)


@cocotb.test()
async def a_reply_that_ends_in_time_is_not_cut_off(dut):
    timeout = await Bench(dut).begin()
    for _ in range(3):
        assert {await timeout.clk(1, 1) for _ in range(timeout.ticks - 1)} == {(1, 0)}
        assert await timeout.clk(0, 1) == (0, 0)


@cocotb.test()
async def noise_matches_the_model(dut):
    timeout = await Bench(dut).begin()
    for _ in range(200):
        requested, often = random.getrandbits(1), random.choice([0.3, 1])
        for _ in range(random.choice([1, 10, timeout.ticks - 1, timeout.ticks + 2])):
            tick = int(random.random() < often)
            await timeout.clk(requested, tick, random.random() < 0.001)


@pytest.mark.parametrize("bits", [16, 64])
def test_transmit_timeout(bits):
    run("transmit_timeout", __file__, BITS=bits)

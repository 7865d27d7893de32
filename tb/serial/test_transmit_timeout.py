# SPDX-License-Identifier: Apache-2.0
"""transmit_timeout: the exact cycle at both ends of the bit time, that the driver stays off, and
noise against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.serial.transmit_timeout import TransmitTimeout


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.bits = dut, int(dut.BITS.value)
        self.model = TransmitTimeout(self.bits)

    async def begin(self):
        await start(self.dut, requested=0, bit_time=0)
        await self.clk(0, 0, rst=1)
        return self

    async def clk(self, requested, bit_time, rst=0):
        self.dut.requested.value, self.dut.bit_time.value, self.dut.rst.value = (
            requested,
            bit_time,
            rst,
        )
        await FallingEdge(self.dut.clk)
        got = int(self.dut.driver_enable.value), int(self.dut.expired.value)
        assert got == self.model.step(requested, bit_time, rst)
        return got


@cocotb.test()
async def the_driver_is_switched_off_once_after_exactly_bits_bit_times(dut):
    timeout = await Bench(dut).begin()
    for bit_time, clk in ((0, 8), (127, 8), (128, 8), (160, 10)):
        seen = [await timeout.clk(1, bit_time) for _ in range(2 * timeout.bits * clk)]
        assert [on for on, _ in seen].index(0) == timeout.bits * clk and seen.index(
            (0, 1)
        ) == timeout.bits * clk
        assert (
            sum(on for on, _ in seen) == timeout.bits * clk
            and sum(expired for _, expired in seen) == 1
        )
        assert await timeout.clk(0, bit_time) == (0, 0)
        assert await timeout.clk(1, bit_time) == (1, 0)
        await timeout.clk(0, bit_time)


@cocotb.test()
async def latency_is_0_from_requested_to_driver_enable(dut):
    await Bench(dut).begin()
    for requested in (1, 0, 1):
        dut.requested.value = requested
        await Timer(1, "ns")  # much less than a cycle
        assert int(dut.driver_enable.value) == requested


@cocotb.test()
async def latency_is_bits_times_bit_time_plus_1_from_requested_to_expired(dut):
    timeout = await Bench(dut).begin()
    for bit_time, clk in ((128, 8), (160, 10)):
        for cycle in range(timeout.bits * clk):
            assert await timeout.clk(1, bit_time) == (1, 0), cycle
        assert await timeout.clk(1, bit_time) == (0, 1)
        await timeout.clk(0, bit_time)


@cocotb.test()
async def a_reply_that_ends_in_time_is_not_cut_off(dut):
    timeout = await Bench(dut).begin()
    for _ in range(3):
        assert set([await timeout.clk(1, 128) for _ in range(timeout.bits * 8)]) == {(1, 0)}
        assert await timeout.clk(0, 128) == (0, 0)


@cocotb.test()
async def the_longest_bit_time_does_not_overflow(dut):
    timeout = await Bench(dut).begin()
    assert set([await timeout.clk(1, 0xFFFFF) for _ in range(5000)]) == {(1, 0)}


@cocotb.test()
async def noise_matches_the_model(dut):
    timeout = await Bench(dut).begin()
    for _ in range(200):
        requested, bit_time = random.getrandbits(1), random.choice([0, 128, 133])
        for _ in range(random.choice([1, 10, 8 * timeout.bits - 1, 8 * timeout.bits + 2])):
            await timeout.clk(requested, bit_time, random.random() < 0.001)


@pytest.mark.parametrize("bits", [16, 64])
def test_transmit_timeout(bits):
    run("transmit_timeout", __file__, BITS=bits)

# SPDX-License-Identifier: Apache-2.0
"""The example in Amaranth: an encoder behind AXI4-Lite, with the test as the master of the bus; and
what a wrong instance is refused with.
"""

import random

import cocotb
import pytest
from amaranth.hdl import Signal
from cocotb.triggers import ClockCycles, FallingEdge

from embed.amaranth_block import instance
from embed.design import DesignError
from embed.examples import axi_lite_encoder
from tb.bench import run, start
from tb.embed.encoder import Encoder
from tb.registers.bus_masters import AxiLiteMaster, BusError
from tb.simulator import BENCHES


@cocotb.test()
async def an_encoder_is_counted_and_read_by_axi(dut):
    master, encoder = AxiLiteMaster(dut), Encoder(dut)
    await start(dut, encoder_z=0, probe=0)
    await ClockCycles(dut.clk, 20)
    await FallingEdge(dut.clk)
    await master.write(8, 0)
    before = 0
    for distance in (7, -19, 300):
        await encoder.move(distance, random.randrange(1, 5))
        await ClockCycles(dut.clk, 12)
        await FallingEdge(dut.clk)
        word = await master.read(0)
        assert word & 0xFFFF == encoder.count & 0xFFFF and word >> 16 != before
        before = word >> 16  # the time of the last edge
    await master.write(8, 5)
    assert await master.read(8) == 5
    with pytest.raises(BusError):
        await master.write(8, 6, strobes=1)
    assert await master.read(8) == 5


def test_axi_lite_encoder():
    axi_lite_encoder.write_verilog(BENCHES / f"{axi_lite_encoder.NAME}.sv")
    run(axi_lite_encoder.NAME, __file__)


@pytest.mark.parametrize(
    "signals, why",
    [
        ({"d": 0, "x": 0}, "synchroniser has no port x; it has clk, rst, d, q"),
        ({}, "the input d of synchroniser is not connected"),
        ({"d": Signal(2)}, "port d of synchroniser has 1 bits, the signal has 2"),
    ],
)
def test_a_wrong_connection_in_amaranth_is_named(signals, why):
    with pytest.raises(DesignError, match=why):
        instance("synchroniser", signals)

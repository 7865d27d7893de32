# SPDX-License-Identifier: Apache-2.0
"""The example of one block: an encoder counted by quadrature_decoder."""

import cocotb
from cocotb.triggers import ClockCycles, FallingEdge

from tb.bench import run, start
from tb.embed.encoder import Encoder


@cocotb.test()
async def the_counter_follows_the_encoder_3_cycles_after_an_edge(dut):
    encoder = Encoder(dut)
    await start(dut, clear=0)
    await ClockCycles(dut.clk, 20)
    await FallingEdge(dut.clk)
    for distance in (1, 5, -3, -40, 25):
        await encoder.move(distance, 1)
        await ClockCycles(dut.clk, 2)
        await FallingEdge(dut.clk)
        assert dut.count.value.to_signed() == encoder.count
    assert not int(dut.lost.value)


@cocotb.test()
async def an_illegal_edge_is_shown_until_the_count_is_cleared(dut):
    encoder = Encoder(dut)
    await start(dut, clear=0)
    await ClockCycles(dut.clk, 20)
    dut.encoder_a.value = dut.encoder_b.value = 1
    await ClockCycles(dut.clk, 10)
    assert int(dut.lost.value)
    encoder.count = 2
    await encoder.move(3, 4)
    dut.clear.value = 1
    await ClockCycles(dut.clk, 1)
    dut.clear.value = 0
    await ClockCycles(dut.clk, 2)
    assert not int(dut.lost.value) and int(dut.count.value) == 0


def test_position_counter():
    run("position_counter", __file__)

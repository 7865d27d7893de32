# SPDX-License-Identifier: Apache-2.0
"""Tests of time_stamp: it counts every cycle, wraps, and starts again after a reset."""

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.common.time_stamp import time_stamp


@cocotb.test()
async def every_cycle_counts_and_the_end_wraps(dut):
    w = int(dut.W.value)
    await start(dut)
    for cycle in range(1, min(3 << w, 2000)):
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        assert int(dut.now.value) == time_stamp(cycle, w), f"cycle {cycle}"


@cocotb.test()
async def latency_is_0_in_the_first_cycle_after_a_reset_in_mid_flow(dut):
    await start(dut)
    for _ in range(7):
        await RisingEdge(dut.clk)
    dut.rst.value = 1
    await RisingEdge(dut.clk)
    dut.rst.value = 0
    await FallingEdge(dut.clk)
    assert int(dut.now.value) == 0
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert int(dut.now.value) == 1


@pytest.mark.parametrize("w", [4, 64])
def test_time_stamp(w):
    run("time_stamp", __file__, W=w)

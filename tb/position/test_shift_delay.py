# SPDX-License-Identifier: Apache-2.0
"""shift_delay: both ends of the range, reset, and random shifts against the model, every cycle."""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.shift_delay import ShiftDelay

LOWEST, HIGHEST = -(1 << 31), (1 << 31) - 1


async def clk(dut, model, shift=0, shift_periods=0, rst=0):
    dut.shift.value, dut.shift_periods.value, dut.rst.value = shift, shift_periods, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    want = model.clk(shift, shift_periods, rst)
    assert int(dut.shifted.value) == want[0]
    if want[1] is not None:
        assert dut.shifted_periods.value.to_signed() == want[1]
    return want


@cocotb.test()
async def latency_is_1(dut):
    await start(dut, shift=0, shift_periods=0)
    model = ShiftDelay()
    assert await clk(dut, model, shift=1, shift_periods=LOWEST) == (1, LOWEST)
    assert await clk(dut, model, shift_periods=3) == (0, LOWEST)
    assert await clk(dut, model, shift=1, shift_periods=HIGHEST) == (1, HIGHEST)


@cocotb.test()
async def a_shift_during_reset_is_dropped(dut):
    await start(dut, shift=0, shift_periods=0)
    model = ShiftDelay()
    assert (await clk(dut, model, shift=1, shift_periods=5, rst=1))[0] == 0
    assert (await clk(dut, model))[0] == 0


@cocotb.test()
async def random_shifts_match_the_model(dut):
    await start(dut, shift=0, shift_periods=0)
    model = ShiftDelay()
    for _ in range(300):
        shift, rst = random.getrandbits(1), int(random.random() < 0.05)
        await clk(dut, model, shift, random.randrange(LOWEST, HIGHEST + 1), rst)


def test_shift_delay():
    run("shift_delay", __file__)

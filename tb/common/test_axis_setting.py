# SPDX-License-Identifier: Apache-2.0
"""Tests of axis_setting: its latency, the initial value, and random accesses against the model."""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.common.axis_setting import AxisSetting

INITIAL = 0x96A5_0F3C


async def begin(dut):
    await start(dut, write=0, write_axis=0, value=0, axis=0)
    await FallingEdge(dut.clk)
    return AxisSetting(int(dut.AXES.value), INITIAL)


async def cycle(dut, model, axis, write=0, write_axis=0, value=0, rst=0):
    """Compare the setting of an axis before the clock edge; returns it."""
    dut.axis.value, dut.write.value, dut.rst.value = axis, write, rst
    dut.write_axis.value, dut.value.value = write_axis, value
    await Timer(1, "ns")
    before = int(dut.stored.value)
    assert before == model.read(axis)
    await FallingEdge(dut.clk)
    model.step(write, write_axis, value, rst)
    return before


@cocotb.test()
async def latency_is_0_from_axis_and_1_from_write(dut):
    model, last = await begin(dut), int(dut.AXES.value) - 1
    assert await cycle(dut, model, last, 1, last, 0xA5) == INITIAL
    assert await cycle(dut, model, last, 1, last, 0x5A) == 0xA5
    assert await cycle(dut, model, last) == 0x5A


@cocotb.test()
async def reset_brings_the_initial_value_back(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for axis in range(axes):
        await cycle(dut, model, axis, 1, axis, axis)
    await cycle(dut, model, 0, 1, 0, 77, rst=1)
    assert {await cycle(dut, model, axis) for axis in range(axes)} == {INITIAL}


@cocotb.test()
async def random_accesses_match_the_model(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for _ in range(2000):
        axis, other = random.randrange(axes), random.randrange(axes)
        write, rst = random.getrandbits(1), int(random.random() < 0.02)
        await cycle(dut, model, axis, write, other, random.getrandbits(32), rst)


@pytest.mark.parametrize("axes", [1, 5, 8])
def test_axis_setting(axes):
    run("axis_setting", __file__, AXES=axes, WIDTH=32, INITIAL=INITIAL)

# SPDX-License-Identifier: Apache-2.0
"""Tests of axis_memory: its latency, a word that is read and written at once, and random accesses
against the model.
"""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run
from tb.common.axis_memory import AxisMemory


async def begin(dut):
    """Clock running, no access; the block has no reset."""
    Clock(dut.clk, 10, "ns").start()
    dut.write.value, dut.write_axis.value, dut.value.value, dut.axis.value = 0, 0, 0, 0
    await FallingEdge(dut.clk)
    return AxisMemory(int(dut.AXES.value))


async def cycle(dut, model, axis, write=0, write_axis=0, value=0):
    """Compare the word of an axis before and after the clock edge; returns it before the edge."""
    dut.axis.value, dut.write.value = axis, write
    dut.write_axis.value, dut.value.value = write_axis, value
    await Timer(1, "ns")
    before = model.read(axis)
    assert before is None or int(dut.stored.value) == before
    await FallingEdge(dut.clk)
    model.step(write, write_axis, value)
    assert model.read(axis) is None or int(dut.stored.value) == model.read(axis)
    return before


@cocotb.test()
async def latency_is_0_from_axis_and_1_from_write(dut):
    model, last = await begin(dut), int(dut.AXES.value) - 1
    await cycle(dut, model, last, 1, last, 0xA5)
    assert await cycle(dut, model, last, 1, last, 0x5A) == 0xA5
    assert await cycle(dut, model, last) == 0x5A


@cocotb.test()
async def each_axis_has_its_word(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for axis in range(axes):
        await cycle(dut, model, axis, 1, axis, 255 - axis)
    assert [await cycle(dut, model, axis) for axis in range(axes)] == [
        255 - axis for axis in range(axes)
    ]


@cocotb.test()
async def random_accesses_match_the_model(dut):
    model, axes = await begin(dut), int(dut.AXES.value)
    for _ in range(2000):
        axis, other = random.randrange(axes), random.randrange(axes)
        await cycle(dut, model, axis, random.getrandbits(1), other, random.getrandbits(8))


@pytest.mark.parametrize("axes", [1, 5, 8])
def test_axis_memory(axes):
    run("axis_memory", __file__, AXES=axes, WIDTH=8)

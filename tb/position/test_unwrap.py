# SPDX-License-Identifier: Apache-2.0
"""Tests of unwrap: by hand, the ends of the range, shifts with and without a step, and every cycle
against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.unwrap import Unwrap

IDLE = dict(valid=0, step=0, phase=0, shift_periods=0)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def clock(dut, valid=0, step=0, phase=0, shift_periods=0):
    dut.valid.value, dut.step.value, dut.phase.value = valid, step, phase
    dut.shift_periods.value = shift_periods
    await FallingEdge(dut.clk)
    return int(dut.done.value), dut.position.value.to_signed()


@cocotb.test()
async def latency_is_1(dut):
    await begin(dut)
    dut.valid.value, dut.phase.value = 1, 77
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.done.value == 1 and dut.position.value == 77
    assert await clock(dut, shift_periods=2) == (0, (2 << 16) + 77)


@cocotb.test()
async def known_steps_add_up_to_the_right_position(dut):
    await begin(dut)
    assert await clock(dut, 1, 12345, 60000) == (1, 60000)  # the first step is ignored
    assert await clock(dut, 1, 10000, 4464) == (1, 70000)
    assert await clock(dut, 1, -65536, 4464) == (1, 4464)
    assert await clock(dut, 1, -4465, 65535) == (1, -1)
    assert await clock(dut, 0, 9, 9) == (0, -1)


@cocotb.test()
async def a_shift_moves_whole_periods_with_or_without_a_step(dut):
    await begin(dut)
    assert await clock(dut, shift_periods=3) == (0, 3 << 16)  # before the first phase
    assert await clock(dut, 1, 0, 100) == (1, (3 << 16) + 100)
    assert await clock(dut, shift_periods=-5) == (0, (-2 << 16) + 100)
    assert await clock(dut, 1, -101, 65535, 2) == (1, -1)
    assert await clock(dut, 1, 65535, 65534, 0) == (1, 65534)


@cocotb.test()
async def the_ends_of_the_range_wrap(dut):
    await begin(dut)
    await clock(dut, 1, 0, 65535, (1 << 31) - 1)
    assert dut.position.value.to_signed() == (1 << 47) - 1
    assert await clock(dut, 1, 1, 0) == (1, -1 << 47)
    assert await clock(dut, 1, -1, 65535) == (1, (1 << 47) - 1)
    assert await clock(dut, shift_periods=-1 << 31) == (0, -1)


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    model = Unwrap()
    for cycle in range(10_000):
        rst, valid, shift = (
            int(random.random() < 0.003),
            random.getrandbits(1),
            int(random.random() < 0.1),
        )
        step, periods = (
            random.randrange(-65536, 65536),
            random.choice((random.randrange(-9, 9), random.randrange(-1 << 31, 1 << 31))),
        )
        phase = (
            (model.position + step) % 65536 if random.random() < 0.99 else random.getrandbits(16)
        )
        dut.rst.value = rst
        got, want = (
            await clock(dut, valid, step, phase, periods * shift),
            model.step(valid, step, phase, periods * shift),
        )
        if rst:
            model, want = Unwrap(), (0, 0)
        assert got == want, f"cycle {cycle}"


def test_unwrap():
    run("unwrap", __file__)

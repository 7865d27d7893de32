# SPDX-License-Identifier: Apache-2.0
"""Tests of zero_crossing: every pass and its direction, none from a shift or a wrap, and every
cycle against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.position.zero_crossing import ZeroCrossing

IDLE = dict(valid=0, position=0, shift=0)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def again(dut):
    """Reset while the clock runs."""
    dut.rst.value, dut.valid.value = 1, 0
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def clock(dut, position, valid=1, shift=0):
    dut.valid.value, dut.position.value, dut.shift.value = valid, position, shift
    await FallingEdge(dut.clk)
    return int(dut.up.value), int(dut.down.value)


async def ride(dut, positions):
    return "".join(
        "u" if up else "d" if down else "." for up, down in [await clock(dut, p) for p in positions]
    )


@cocotb.test()
async def latency_is_1(dut):
    await begin(dut)
    await clock(dut, -1)
    dut.position.value = 0
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.up.value == 1


@cocotb.test()
async def every_pass_is_reported_with_its_direction(dut):
    await begin(dut)
    assert await ride(dut, [5, 0, -1, -2, 0, -1, 65535, 3, -65536, -1]) == "..d.udu.d."


@cocotb.test()
async def the_first_position_after_reset_is_no_crossing(dut):
    await begin(dut)
    for first in (-7, 7):
        await again(dut)
        assert await ride(dut, [first, first]) == ".."


@cocotb.test()
async def a_shift_is_no_crossing(dut):
    await begin(dut)
    await ride(dut, [5, 6])
    assert await clock(dut, 6, 0, 1) == (0, 0)
    assert await clock(dut, 6 - 131072, 0) == (0, 0)
    assert await ride(dut, [7 - 131072, -1, 0]) == "..u"
    assert await clock(dut, -1, 1, 1) == (0, 1)  # the cycle of the strobe still uses the old origin
    assert await ride(dut, [131071, 131072, -1]) == "..d"


@cocotb.test()
async def the_ends_of_the_range_are_no_crossing(dut):
    await begin(dut)
    high, low = (1 << 47) - 1, -1 << 47
    assert await ride(dut, [high, low, high, low]) == "...."


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    await begin(dut)
    model = ZeroCrossing()
    for cycle in range(10_000):
        rst, valid, shift = (int(random.random() < share) for share in (0.003, 0.5, 0.1))
        position = random.choice((random.randrange(-3, 3), random.randrange(-1 << 47, 1 << 47)))
        dut.rst.value = rst
        got, want = await clock(dut, position, valid, shift), model.step(valid, position, shift)
        if rst:
            model, want = ZeroCrossing(), (0, 0)
        assert got == want, f"cycle {cycle}"


def test_zero_crossing():
    run("zero_crossing", __file__)

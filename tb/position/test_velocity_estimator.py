# SPDX-License-Identifier: Apache-2.0
"""velocity_estimator: by hand, both ends, shifts in and between ticks, and every clk against the model."""
import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from bench import run, start
from velocity_estimator import VelocityEstimator

IDLE = dict(tick=0, position=0, shift=0, shift_periods=0)


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)


async def clock(dut, position, tick=1, shift=0, shift_periods=0):
    dut.tick.value, dut.position.value, dut.shift.value, dut.shift_periods.value = tick, position, shift, shift_periods
    await FallingEdge(dut.clk)
    return dut.velocity.value.to_signed()


@cocotb.test()
async def latency_is_1(dut):
    await begin(dut)
    await clock(dut, 100)
    dut.position.value = 103
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.velocity.value == 3


@cocotb.test()
async def by_hand(dut):
    await begin(dut)
    assert [await clock(dut, p) for p in (1000, 1004, 1004, 900)] == [0, 4, 0, -104]
    assert [await clock(dut, p, tick=0) for p in (1000, 1004)] == [-104, -104]
    assert await clock(dut, 950) == 50


@cocotb.test()
async def a_shift_leaves_no_trace(dut):
    await begin(dut)
    await clock(dut, 1000)
    assert await clock(dut, 1010) == 10
    await clock(dut, 1015, 0, 1, -7)                            # between ticks
    assert await clock(dut, 1020 - (7 << 16)) == 10
    assert await clock(dut, 1030 - (7 << 16), 1, 1, 100_000) == 10   # in the clk of a tick: still the old origin
    assert await clock(dut, 1040 + (99_993 << 16)) == 10


@cocotb.test()
async def the_velocity_stops_at_both_ends(dut):
    await begin(dut)
    end = 1 << 31
    for far, want in ((end - 1, end - 1), (end, end - 1), (1 << 46, end - 1), (-end, -end), (-end - 1, -end), (-1 << 46, -end)):
        await clock(dut, 0)
        assert await clock(dut, far) == want


@cocotb.test()
async def the_wrap_of_the_position_is_no_velocity(dut):
    await begin(dut)
    await clock(dut, (1 << 47) - 1)
    assert await clock(dut, -1 << 47) == 1
    assert await clock(dut, (1 << 47) - 3) == -3


@cocotb.test()
async def any_input_matches_the_model_in_every_clk(dut):
    await begin(dut)
    model, position = VelocityEstimator(), 0
    for clk in range(10_000):
        rst, tick, shift = (int(random.random() < share) for share in (0.003, 0.3, 0.1))
        position += random.choice((0, random.randrange(-99, 99), random.randrange(-1 << 33, 1 << 33)))
        position = (position + (1 << 47)) % (1 << 48) - (1 << 47)
        periods = random.randrange(-1 << 31, 1 << 31)
        dut.rst.value = rst
        got, want = await clock(dut, position, tick, shift, periods), model.step(tick, position, shift, periods)
        if rst:
            model, want = VelocityEstimator(), 0
        assert got == want, f"clk {clk}"
        position = (position + (shift * periods << 16) + (1 << 47)) % (1 << 48) - (1 << 47)


def test_velocity_estimator():
    run("velocity_estimator", __file__)

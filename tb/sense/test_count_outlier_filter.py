# SPDX-License-Identifier: Apache-2.0
"""Tests of count_outlier_filter: the three cases of S0's equation, its lag, its behaviour at rest,
both ends of the range, and every cycle against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.count_outlier_filter import CountOutlierFilter


async def begin(dut):
    await start(dut, enable=1, valid=0, count=0)
    await FallingEdge(dut.clk)


async def again(dut):
    """Reset while the clock runs."""
    dut.rst.value, dut.valid.value = 1, 0
    await FallingEdge(dut.clk)
    dut.rst.value = 0


async def clock(dut, count, valid=1, enable=1):
    dut.count.value, dut.valid.value, dut.enable.value = count, valid, enable
    await FallingEdge(dut.clk)
    return int(dut.done.value), dut.count_out.value.to_signed()


async def feed(dut, counts, **settings):
    return [(await clock(dut, count, **settings))[1] for count in counts]


@cocotb.test()
async def latency_is_1(dut):
    await begin(dut)
    dut.valid.value, dut.count.value = 1, 77
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    assert dut.done.value == 1 and dut.count_out.value == 77


@cocotb.test()
async def the_three_cases_of_the_equation_are_right_by_hand(dut):
    await begin(dut)
    assert await feed(dut, [100, 100]) == [100, 100]  # difference 0: unchanged
    assert await feed(dut, [101, 99, 101]) == [100, 100, 100]  # difference 1: the preceding count
    assert await feed(dut, [102, 104, 110]) == [101, 102, 106]  # more: the mean of both
    assert await feed(dut, [103, 100, 97]) == [104, 102, 99]  # rounded down


@cocotb.test()
async def with_enable_0_every_count_passes(dut):
    await begin(dut)
    counts = [0, 1, 5, 90, -90, 7]
    assert await feed(dut, counts, enable=0) == counts
    assert await feed(dut, [8, 17]) == [7, 12]  # the filter continues from there


@cocotb.test()
async def a_gap_between_counts_changes_nothing(dut):
    await begin(dut)
    await feed(dut, [10])
    assert await clock(dut, 99, valid=0) == (0, 10)
    assert await clock(dut, 20) == (1, 15)


@cocotb.test()
async def it_lags_v_counts_going_up_and_one_less_going_down(dut):
    await begin(dut)
    for v in (2, 3, 10):
        for sign, lag in ((1, v), (-1, v - 1)):
            await again(dut)
            counts = [sign * v * n for n in range(-50, 10) if sign * v * n in range(-120, 121)]
            seen = await feed(dut, [counts[0]] * 2 + counts)
            assert abs(counts[-1] - seen[-1]) == lag


@cocotb.test()
async def at_rest_the_output_may_stay_one_count_off(dut):
    await begin(dut)
    assert (await feed(dut, [0] + [50] * 20))[-1] == 49
    assert (await feed(dut, [0] * 20))[-1] == 1


@cocotb.test()
async def the_ends_of_the_range_wrap(dut):
    await begin(dut)
    top = (1 << int(dut.W.value) - 1) - 1
    assert await feed(dut, [top - 1, top, -top - 1, -top + 2, top - 3]) == [
        top - 1,
        top - 1,
        top,
        -top,
        top - 1,
    ]


@cocotb.test()
async def any_counts_match_the_model(dut):
    await begin(dut)
    w = int(dut.W.value)
    model, count, last = CountOutlierFilter(w), 0, None
    for cycle in range(6000):
        rst, valid, enable = (
            int(random.random() < 0.005),
            random.getrandbits(1),
            int(random.random() < 0.95),
        )
        count = model.wrapped(
            count
            + random.choice(
                (0, 1, -1, random.randrange(-9, 10), random.randrange(-1 << w - 1, 1 << w - 1))
            )
        )
        dut.rst.value = rst
        done, out = await clock(dut, count, valid, enable)
        if valid:
            last = model.follow(enable, count)
        if rst:
            model = CountOutlierFilter(w)
        assert done == (valid and not rst) and (last is None or out == last), f"cycle {cycle}"


@pytest.mark.parametrize("w", [8, 32])
def test_count_outlier_filter(w):
    run("count_outlier_filter", __file__, W=w)

# SPDX-License-Identifier: Apache-2.0
"""Tests of deglitcher: pulses just too short and just long enough, both ends of the setting, start-
up, and random levels against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.deglitcher import Deglitcher


async def begin(dut, level=0, stable_cycles=0):
    """Reset with the input at this level; the model has seen the same cycle."""
    await start(dut, level=level, stable_cycles=stable_cycles)
    model = Deglitcher(int(dut.SETTLE.value))
    model.step(stable_cycles, level, 1)
    return model


async def drive(dut, model, stable_cycles, levels, rst=0):
    """Apply each level for one cycle and compare design and model; return (filtered, rejected) of
    each cycle.
    """
    dut.stable_cycles.value, dut.rst.value, out = stable_cycles, rst, []
    for cycle, level in enumerate(levels):
        dut.level.value = level
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        got, want = (
            (int(dut.filtered.value), int(dut.rejected.value)),
            model.step(stable_cycles, level, rst),
        )
        assert got == want, (
            f"cycle {cycle}, stable_cycles {stable_cycles}: "
            f"(filtered, rejected) is {got}, the model has {want}"
        )
        out.append(got)
    dut.rst.value = 0
    return out


@cocotb.test()
async def latency_is_stable_cycles(dut):
    model = await begin(dut)
    await drive(dut, model, 1, [0] * 10)
    for stable_cycles in (0, 1, 2, 3, 7):
        for level in (1, 0):
            out = await drive(dut, model, stable_cycles, [level] * (stable_cycles + 2))
            assert [filtered for filtered, _ in out].index(level) + 1 == max(1, stable_cycles)
            assert not any(rejected for _, rejected in out)


@cocotb.test()
async def a_pulse_shorter_by_one_cycle_is_rejected_and_reported_once(dut):
    model = await begin(dut)
    await drive(dut, model, 5, [0] * 10)
    out = await drive(dut, model, 5, [1] * 4 + [0] * 8)
    assert out == [(0, 0)] * 4 + [(0, 1)] + [(0, 0)] * 7
    out = await drive(dut, model, 5, [1] * 5 + [0] * 8)
    assert out == [(0, 0)] * 4 + [(1, 0)] * 5 + [(0, 0)] * 4


@cocotb.test()
async def a_train_of_short_pulses_never_passes(dut):
    model = await begin(dut)
    await drive(dut, model, 4, [0] * 10)
    out = await drive(dut, model, 4, [1, 1, 1, 0] * 50)
    assert out == [(0, 0), (0, 0), (0, 0), (0, 1)] * 50


@cocotb.test()
async def a_level_that_is_constant_from_power_up_makes_no_edge(dut):
    for level in (1, 0):
        model = await begin(dut, level=level, stable_cycles=15)
        assert await drive(dut, model, 15, [level] * 40) == [(level, 0)] * 40


@cocotb.test()
async def latency_is_1_during_start_up_so_filling_synchronisers_make_no_edge(dut):
    model = await begin(dut, level=0, stable_cycles=15)
    filling = int(dut.SETTLE.value) - 1
    out = await drive(dut, model, 15, [0] * filling + [1] * 40)
    assert out == [(0, 0)] * filling + [(1, 0)] * 40


@cocotb.test()
async def the_longest_setting_passes_after_exactly_that_time(dut):
    longest = min((1 << int(dut.W.value)) - 1, 4095)
    model = await begin(dut)
    await drive(dut, model, longest, [0] * 10)
    out = await drive(dut, model, longest, [1] * longest)
    assert [filtered for filtered, _ in out] == [0] * (longest - 1) + [1]
    out = await drive(dut, model, longest, [0] * (longest - 1) + [1] * 2)
    assert out[-2:] == [(1, 1), (1, 0)]


@cocotb.test()
async def a_smaller_setting_acts_at_once(dut):
    model = await begin(dut)
    await drive(dut, model, 15, [0] * 10)
    await drive(dut, model, 15, [1] * 8)
    assert await drive(dut, model, 3, [1]) == [(1, 0)]


@cocotb.test()
async def reset_in_the_middle_of_a_pulse_forgets_it(dut):
    model = await begin(dut)
    await drive(dut, model, 6, [0] * 10)
    await drive(dut, model, 6, [1] * 4)
    await drive(dut, model, 6, [0], rst=1)
    assert await drive(dut, model, 6, [0] * 10) == [(0, 0)] * 10


@cocotb.test()
async def any_levels_match_the_model(dut):
    model = await begin(dut)
    for _ in range(300):
        stable_cycles, pulse = random.choice([0, 1, 2, 3, 5, 8, 15]), random.choice([2, 4, 16])
        levels = [
            bit
            for _ in range(40 // pulse)
            for bit in [random.getrandbits(1)] * random.randint(1, pulse)
        ]
        await drive(dut, model, stable_cycles, levels)
        if random.random() < 0.05:
            await drive(dut, model, stable_cycles, levels[:2], rst=1)


@pytest.mark.parametrize("w, settle", [(16, 4), (4, 1)])
def test_deglitcher(w, settle):
    run("deglitcher", __file__, W=w, SETTLE=settle)

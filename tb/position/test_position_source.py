# SPDX-License-Identifier: Apache-2.0
"""position_source: both sources, built with sine and cosine and without, against the model."""

import itertools
import random

import cocotb
import pytest
from cocotb.triggers import Timer

from tb.bench import run
from tb.position.position_source import source

TRACKED, COUNTED = (1, -5, 77), (0, 16384, 49152)


async def outputs(dut, use_counts=0, sample_tick=0, tracked=TRACKED, counted=COUNTED):
    """All outputs, without a clock; they match the model."""
    dut.use_counts.value, dut.sample_tick.value = use_counts, sample_tick
    dut.tracked.value, dut.tracked_step.value, dut.tracked_phase.value = tracked
    dut.counted.value, dut.counted_step.value, dut.counted_phase.value = counted
    await Timer(1, "ns")
    want = source(int(dut.HAS_SINE.value), use_counts, sample_tick, tracked, counted)
    got = {name: int(getattr(dut, name).value) for name in want if name != "step"}
    assert got | dict(step=dut.step.value.to_signed()) == want
    return want


@cocotb.test()
async def latency_is_0_and_the_step_passes_in_its_own_cycle(dut):
    got = await outputs(dut, use_counts=1)
    assert (got["valid"], got["step"], got["phase"]) == COUNTED
    if int(dut.HAS_SINE.value):
        got = await outputs(dut, use_counts=0)
        assert (got["valid"], got["step"], got["phase"]) == TRACKED


@cocotb.test()
async def the_adc_is_started_only_for_a_position_of_phases(dut):
    sine = int(dut.HAS_SINE.value)
    assert (await outputs(dut, use_counts=0, sample_tick=1))["convert"] == sine
    assert (await outputs(dut, use_counts=1, sample_tick=1))["convert"] == 0
    assert (await outputs(dut, use_counts=0, sample_tick=0))["convert"] == 0


@cocotb.test()
async def all_levels_with_random_steps_match_the_model(dut):
    for use_counts, tick, tracked, counted in itertools.product((0, 1), repeat=4):
        for edge in (-65536, 65535, random.randrange(-65536, 65536)):
            await outputs(
                dut,
                use_counts,
                tick,
                (tracked, edge, random.getrandbits(16)),
                (counted, -edge - 1, random.getrandbits(16)),
            )


@pytest.mark.parametrize("sine", [0, 1])
def test_position_source(sine):
    run("position_source", __file__, HAS_SINE=sine)

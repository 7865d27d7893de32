# SPDX-License-Identifier: Apache-2.0
"""Tests of sample_hold: its latency, and random strobes against the model in every cycle."""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tb.bench import run
from tb.interpolate.sample_hold import SampleHold


async def begin(dut):
    """Clock running, no strobe; the block has no reset."""
    dut.sampled.value, dut.tracked.value = 0, 0
    Clock(dut.clk, 10, "ns").start()
    await FallingEdge(dut.clk)
    return SampleHold()


async def cycle(dut, model, sampled, sin, cos, tracked, phase):
    dut.sampled.value, dut.sampled_sin.value, dut.sampled_cos.value = sampled, sin, cos
    dut.tracked.value, dut.tracked_phase.value = tracked, phase
    await FallingEdge(dut.clk)
    want = model.step(sampled, sin, cos, tracked, phase)
    if want[0] is not None:
        assert (dut.sin.value.to_signed(), dut.cos.value.to_signed()) == want[:2]
    if want[2] is not None:
        assert dut.phase.value == want[2]
    return want


@cocotb.test()
async def latency_is_1_and_values_of_others_are_ignored(dut):
    model, full = await begin(dut), 1 << int(dut.W.value) - 1
    assert await cycle(dut, model, 1, -full, full - 1, 1, 65535) == (-full, full - 1, 65535)
    assert await cycle(dut, model, 0, 1, 2, 0, 3) == (-full, full - 1, 65535)


@cocotb.test()
async def any_strobes_match_the_model_in_every_cycle(dut):
    model, full = await begin(dut), 1 << int(dut.W.value) - 1
    for _ in range(1000):
        sin, cos = random.randrange(-full, full), random.randrange(-full, full)
        strobes = random.getrandbits(1), random.getrandbits(1)
        await cycle(dut, model, strobes[0], sin, cos, strobes[1], random.getrandbits(16))


@pytest.mark.parametrize("w", [8, 16])
def test_sample_hold(w):
    run("sample_hold", __file__, W=w)

# SPDX-License-Identifier: Apache-2.0
"""core_wait: the exact times, an event before and during the wait, and random levels against the
model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.cpu.core_wait import CoreWait


async def cycle(dut, **inputs):
    for name, level in (dict(start=0, cycles=0, wake=0, rst=0) | inputs).items():
        getattr(dut, name).value = level
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.waits.value)


async def begin(dut):
    await start(dut, start=0, cycles=0, wake=0)
    await cycle(dut, rst=1)


@cocotb.test()
async def latency_is_1_cycle_and_the_wait_lasts_1_cycle_more_than_are_set(dut):
    await begin(dut)
    for cycles in (0, 3, 200, 255, *(1 << n for n in range(8))):
        assert await cycle(dut, start=1, cycles=cycles)
        seen = [await cycle(dut, cycles=cycles) for _ in range(cycles + 5)]
        assert seen == [1] * cycles + [0] * 5


@cocotb.test()
async def an_event_ends_the_wait_after_1_cycle(dut):
    await begin(dut)
    assert await cycle(dut, start=1, cycles=200)
    assert all([await cycle(dut, cycles=200) for _ in range(20)])
    assert not await cycle(dut, cycles=200, wake=1)
    assert not any([await cycle(dut) for _ in range(250)])


@cocotb.test()
async def no_wait_begins_while_there_is_something_to_do(dut):
    await begin(dut)
    assert not await cycle(dut, start=1, cycles=200, wake=1)
    assert not any([await cycle(dut, cycles=200) for _ in range(250)])


@cocotb.test()
async def random_levels_match_the_model(dut):
    await begin(dut)
    model, most = CoreWait(), (1 << int(dut.W.value)) - 1
    cycles = 0
    for n in range(5000):
        if begins := random.random() < 0.1:
            await cycle(dut, cycles=cycles)
            model.step()
            cycles = random.choice([0, 1, 2, random.randrange(30), random.randint(0, most)])
        inputs = dict(
            start=int(begins),
            cycles=cycles,
            wake=int(random.random() < 0.05),
            rst=int(random.random() < 0.01),
        )
        assert await cycle(dut, **inputs) == model.step(**inputs), f"cycle {n}"


@pytest.mark.parametrize("w", [8, 24])
def test_core_wait(w):
    run("core_wait", __file__, W=w)

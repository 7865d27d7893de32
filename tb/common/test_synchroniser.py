# SPDX-License-Identifier: Apache-2.0
"""Tests of synchroniser: its latency, its state at reset, and random levels against the model. With
CROSSINGS=seed in the environment, of the one in whose place a change may arrive one cycle later.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import needs, run, start, steady_only
from tb.common.synchroniser import Synchroniser
from twin import crossings


def model_of(dut):
    sizes = int(dut.W.value), int(dut.STAGES.value), dut.RESET.value.to_signed()
    return Synchroniser(*sizes)


async def cycle(dut, d, rst=0):
    dut.d.value, dut.rst.value = d, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.q.value)


@cocotb.test()
async def latency_is_stages(dut):
    steady_only("the latency is STAGES or one cycle more")
    await start(dut, d=0)
    stages = int(dut.STAGES.value)
    for _ in range(stages):
        await cycle(dut, 0)
    assert [await cycle(dut, 1) for _ in range(stages)] == [0] * (stages - 1) + [1]


@cocotb.test()
async def with_crossings_half_of_the_changes_of_each_bit_arrive_one_cycle_later(dut):
    needs(crossings.seed(), "the synchroniser of the RTL")
    await start(dut, d=0)
    stages, w = int(dut.STAGES.value), int(dut.W.value)
    for bit in range(w):
        for _ in range(stages + 1):
            await cycle(dut, 0)
        delays = []
        for level in [1, 0] * 50:
            arrived = [await cycle(dut, level << bit) >> bit & 1 for _ in range(stages + 3)]
            delays.append(arrived.index(level) + 1)
            assert arrived[delays[-1] :] == [level] * (stages + 3 - delays[-1]), "it stays there"
        assert set(delays) == {stages, stages + 1}
        assert 25 <= delays.count(stages) <= 75


@cocotb.test()
async def q_is_the_reset_level_from_reset_until_the_first_level_arrives(dut):
    steady_only("the first level may arrive one cycle later")
    await start(dut, d=0)
    level, stages = model_of(dut).reset, int(dut.STAGES.value)
    other = ~level % (1 << int(dut.W.value))
    for _ in range(stages + 1):
        await cycle(dut, other)
    assert await cycle(dut, other, rst=1) == level
    assert [await cycle(dut, other) for _ in range(stages)] == [level] * (stages - 1) + [other]


@cocotb.test()
async def any_level_matches_the_model(dut):
    await start(dut, d=0)
    model = model_of(dut)
    for n in range(1000):
        d, rst = random.getrandbits(int(dut.W.value)), int(random.random() < 0.02 or n == 0)
        assert await cycle(dut, d, rst) == model.step(d, rst), f"cycle {n}"


@pytest.mark.parametrize("w, stages, reset", [(1, 2, 0), (5, 3, -1), (2, 2, 3)])
def test_synchroniser(w, stages, reset):
    run("synchroniser", __file__, W=w, STAGES=stages, RESET=reset)

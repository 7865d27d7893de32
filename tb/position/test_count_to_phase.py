# SPDX-License-Identifier: Apache-2.0
"""Tests of count_to_phase: by hand, every count with every alignment, a reset, and every cycle
against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.position.count_to_phase import CountToPhase

IDLE = dict(tick=0, count_step=0, align=0, align_counts=0)


class Counts:
    """The design compared with its model in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, CountToPhase()

    async def begin(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        return self

    async def cycle(self, rst=0, **inputs):
        now = IDLE | inputs
        for name, value in [*now.items(), ("rst", rst)]:
            getattr(self.dut, name).value = value
        await FallingEdge(self.dut.clk)
        got = dict(
            valid=int(self.dut.valid.value),
            step=self.dut.step.value.to_signed(),
            phase=int(self.dut.phase.value),
        )
        want = self.model.step(rst, **now)
        assert got == want, f"{now}: {got}, the model has {want}"
        return got["valid"], got["step"], got["phase"]


@cocotb.test()
async def latency_is_1_and_steps_are_right_by_hand(dut):
    counts = await Counts(dut).begin()
    assert await counts.cycle() == (0, 0, 0)
    assert await counts.cycle(tick=1) == (1, 0, 0)
    assert await counts.cycle(count_step=-1) == (1, -16384, 49152)
    assert await counts.cycle(count_step=1, tick=1) == (1, 16384, 0)
    assert await counts.cycle(align_counts=2) == (0, 0, 0)
    assert await counts.cycle(align=1, align_counts=2, count_step=1) == (1, 49152, 49152)
    assert await counts.cycle(align=1, align_counts=-2, count_step=-1) == (1, -49152, 0)


@cocotb.test()
async def a_reset_in_mid_flow_begins_at_phase_zero(dut):
    counts = await Counts(dut).begin()
    await counts.cycle(count_step=1)
    await counts.cycle(1, count_step=1, tick=1)
    assert await counts.cycle(tick=1) == (1, 0, 0)


@cocotb.test()
async def every_cycle_matches_the_model_and_the_steps_add_up_to_the_phase(dut):
    counts, total = await Counts(dut).begin(), 0
    for _ in range(3000):
        _, step, phase = await counts.cycle(
            tick=random.random() < 0.2,
            count_step=random.choice((-1, 0, 0, 1)),
            align=random.random() < 0.1,
            align_counts=random.randint(-2, 2),
        )
        total += step
        assert total % 65536 == phase


def test_count_to_phase():
    run("count_to_phase", __file__)

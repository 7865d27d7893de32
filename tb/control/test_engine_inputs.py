# SPDX-License-Identifier: Apache-2.0
"""engine_inputs: requests and levels by hand, and at random against the model in every cycle."""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.control.engine_inputs import EngineInputs

IDLE = dict.fromkeys(
    ("tick", "sample", "elapsed", "position", "stepped", "downward", "block_up", "block_down")
    + ("closed_loop", "request", "done"),
    0,
)


class Inputs:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, EngineInputs()

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.model.clk(rst=1)
        await self.clk(stepped=1, elapsed=9)  # from here on all outputs are known
        await self.clk(tick=1)
        return self

    async def clk(self, rst=0, **inputs):
        dut = self.dut
        inputs = dict(IDLE, rst=rst) | inputs
        for name, value in inputs.items():
            getattr(dut, name).value = value
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        want = self.model.clk(**inputs)
        got = (
            dut.seen_position.value.to_signed(),
            int(dut.seen_elapsed.value) if want[1] is not None else None,
            int(dut.seen.value),
            int(dut.levels.value) if want[1] is not None else want[3],
            int(dut.asked.value),
            int(dut.gains.value),
        )
        assert got == want, f"{inputs}: {got}, the model has {want}"
        return got


@cocotb.test()
async def latency_is_1_from_a_request_to_asked_and_from_a_tick_to_what_is_seen(dut):
    inputs = await Inputs(dut).reset()
    assert (await inputs.clk(request=2))[4] == 1
    assert (await inputs.clk(tick=1, position=-5))[0::2] == (-5, 2, 1)
    assert (await inputs.clk(done=2))[2:5:2] == (0, 0)


@cocotb.test()
async def a_request_that_comes_while_one_is_served_is_not_lost(dut):
    inputs = await Inputs(dut).reset()
    await inputs.clk(request=1)
    await inputs.clk(sample=1, request=1)
    assert (await inputs.clk(done=1))[2:5:2] == (0, 1)
    assert (await inputs.clk(sample=1))[2] == 1


@cocotb.test()
async def a_sample_leaves_a_change_of_the_gains_for_the_tick(dut):
    inputs = await Inputs(dut).reset()
    await inputs.clk(request=64)
    assert (await inputs.clk(sample=1))[2::3] == (0, 1)
    assert (await inputs.clk(tick=1))[2::3] == (64, 1)


@cocotb.test()
async def a_step_in_the_cycle_of_the_tick_belongs_to_the_next_tick(dut):
    inputs = await Inputs(dut).reset()
    assert (await inputs.clk(tick=1, stepped=1, downward=1))[3] & 1 == 0
    assert (await inputs.clk(tick=1))[1] == 0
    assert inputs.model.levels & 3 == 3


@cocotb.test()
async def random_cycles_match_the_model(dut):
    inputs = await Inputs(dut).reset()
    for _ in range(4000):
        await inputs.clk(
            rst=int(random.random() < 0.005),
            tick=int(random.random() < 0.1),
            sample=int(random.random() < 0.1),
            elapsed=random.getrandbits(24),
            position=random.getrandbits(48) - (1 << 47),
            stepped=int(random.random() < 0.2),
            downward=random.getrandbits(1),
            block_up=int(random.random() < 0.1),
            block_down=int(random.random() < 0.1),
            closed_loop=int(random.random() < 0.9),
            request=random.getrandbits(7) & random.getrandbits(7),
            done=random.getrandbits(7) & random.getrandbits(7),
        )


def test_engine_inputs():
    run("engine_inputs", __file__)

# SPDX-License-Identifier: Apache-2.0
"""engine_outputs: each kind of result, when a request is shown, and random results against the
model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tables.microcode.numbers import GIVEN
from tb.bench import run, start
from tb.control.engine_outputs import ARMED, MOVING, EngineOutputs

IDLE = dict(valid=0, kind=0, result=0, flag=0, waits=0, line_start=0)
SIGNED = ("target", "velocity", "error")


class Outputs:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, EngineOutputs()

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        return self

    def value(self, name):
        value = getattr(self.dut, name).value
        return value.to_signed() if name in SIGNED else int(value)

    async def clk(self, rst=0, **inputs):
        """Advance one cycle; returns the strobes in it, pending too."""
        dut, model, inputs = self.dut, self.model, IDLE | inputs
        for name, level in inputs.items():
            getattr(dut, name).value = level
        dut.rst.value = rst
        await Timer(1, "ns")
        want = model.strobes(**inputs) | dict(pending=model.pending(inputs["waits"]))
        assert {name: int(getattr(dut, name).value) for name in want} == want
        if want["error_valid"]:
            assert int(dut.too_far.value) == inputs["flag"]
        if want["command_valid"]:
            assert int(dut.command.value) == inputs["result"] % 65536
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        model.clk(rst=rst, **inputs)
        assert {name: self.value(name) for name in model.levels} == model.levels
        return want

    async def give(self, name, result=0, flag=0, **more):
        return await self.clk(valid=1, kind=GIVEN.index(name), result=result, flag=flag, **more)


@cocotb.test()
async def latency_is_1_to_a_level_and_0_to_a_strobe(dut):
    outputs = await Outputs(dut).reset()
    await outputs.give("target", -5)
    assert outputs.value("target") == -5
    await outputs.give("state", MOVING | ARMED | 3 << 20)
    assert [outputs.value(n) for n in ("moving", "armed", "queue_free")] == [1, 1, 13]
    for velocity in (3, -3, 0):
        await outputs.give("target_velocity", velocity)
        before = outputs.value("line_up"), outputs.value("line_down")
        await outputs.clk()
        assert (outputs.value("line_up"), outputs.value("line_down")) == before
        await outputs.clk(line_start=1)
        found = outputs.value("line_up"), outputs.value("line_down")
        assert found == (int(velocity > 0), int(velocity < 0))
    assert (await outputs.give("error", 7, 1))["error_valid"]
    assert (await outputs.give("command", -7, 1))["command_valid"]
    assert outputs.value("saturated") == 1
    assert (await outputs.give("underrun"))["underrun"]


@cocotb.test()
async def a_request_is_pending_until_a_state_after_it_is_shown(dut):
    outputs = await Outputs(dut).reset()
    assert (await outputs.clk(waits=1))["pending"]
    assert (await outputs.give("state", waits=1))["pending"]  # of a request before
    assert (await outputs.clk())["pending"]
    assert (await outputs.give("target"))["pending"]
    assert (await outputs.give("state", MOVING))["pending"]
    assert not (await outputs.clk())["pending"] and outputs.value("moving")


@cocotb.test()
async def random_results_match_the_model(dut):
    outputs = await Outputs(dut).reset()
    for _ in range(3000):
        bits = random.choice((3, 16, 32, 47))
        await outputs.clk(
            rst=int(random.random() < 0.01),
            valid=random.getrandbits(1),
            kind=random.randrange(8),
            result=random.getrandbits(bits) - random.choice((0, 1 << bits - 1)),
            flag=random.getrandbits(1),
            waits=int(random.random() < 0.1),
            line_start=int(random.random() < 0.3),
        )


def test_engine_outputs():
    run("engine_outputs", __file__)

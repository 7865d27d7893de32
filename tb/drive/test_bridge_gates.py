# SPDX-License-Identifier: Apache-2.0
"""bridge_gates: each state by hand, dead time and shortest pulse to the clk, brake, decay, and random levels against the model."""
import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.drive.bridge_gates import BridgeGates

IDLE = dict(dead_time=0, minimum_pulse=0, fast_decay=0, brake=0, bridge_a=0, bridge_b=0)
PINS = ("gate_a_high", "gate_a_low", "gate_b_high", "gate_b_low")
DRIVES_A, DRIVES_B, BRAKES, COASTS = (1, 0, 0, 1), (0, 1, 1, 0), (0, 1, 0, 1), (0, 0, 0, 0)


class Bridge:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, BridgeGates(), dict(IDLE)

    async def reset(self, **inputs):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.inputs.update(inputs)
        return self

    async def clk(self, levels=None, rst=0, **inputs):
        if levels is not None:
            inputs |= dict(bridge_a=levels >> 1, bridge_b=levels & 1)
        self.inputs.update(inputs)
        for name, level in dict(self.inputs, rst=rst).items():
            getattr(self.dut, name).value = level
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        got, want = tuple(int(getattr(self.dut, pin).value) for pin in PINS), self.model.clk(rst=rst, **self.inputs)
        assert got == want, f"{self.inputs}: the gates are {got}, the model has {want}"
        assert not (got[0] and got[1] or got[2] and got[3])
        return got

    async def run(self, clk, levels=None, **inputs):
        return [await self.clk(levels, **inputs) for _ in range(clk)][-1]


@cocotb.test()
async def each_state_by_hand(dut):
    bridge = await Bridge(dut).reset(dead_time=3)
    for levels, fast_decay, brake, gates in ((0b10, 0, 0, DRIVES_A), (0b01, 0, 0, DRIVES_B), (0b11, 0, 0, BRAKES), (0b11, 1, 0, COASTS),
                                             (0b00, 0, 0, COASTS), (0b10, 1, 0, DRIVES_A), (0b10, 0, 1, BRAKES), (0b00, 1, 1, BRAKES),
                                             (0b11, 1, 1, BRAKES), (0b01, 1, 0, DRIVES_B)):
        assert await bridge.run(12, levels, fast_decay=fast_decay, brake=brake) == gates


@cocotb.test()
async def dead_time_to_the_clk_at_both_ends(dut):
    bridge = await Bridge(dut).reset()
    for dead_time, clk in ((0, 1), (1, 1), (2, 2), (9, 9), (255, 255)):
        await bridge.run(300, 0b10, dead_time=dead_time)
        for n in range(clk):
            assert await bridge.clk(0b01) == COASTS, n
        assert await bridge.clk() == DRIVES_B


@cocotb.test()
async def off_is_1_clk_even_in_the_shortest_pulse(dut):
    bridge = await Bridge(dut).reset(dead_time=2, minimum_pulse=100)
    for wait in (1, 2, 3, 50, 200):
        await bridge.run(5, 0b00)
        await bridge.run(wait, 0b10)
        assert await bridge.clk(0b00) == COASTS


@cocotb.test()
async def a_gate_stays_on_for_the_shortest_pulse(dut):
    bridge = await Bridge(dut).reset(dead_time=2)
    for minimum_pulse, clk in ((0, 1), (1, 1), (7, 7), (255, 255)):
        await bridge.run(520, 0b11, minimum_pulse=minimum_pulse)
        await bridge.run(3, 0b10)
        assert await bridge.clk(0b11) == (DRIVES_A if clk > 1 else (0, 0, 0, 1))
        assert sum([(await bridge.clk())[0] for _ in range(300)]) == max(0, clk - 2)


@cocotb.test()
async def a_command_taken_back_within_the_dead_time_makes_no_pulse(dut):
    bridge = await Bridge(dut).reset(dead_time=8)
    await bridge.run(20, 0b11)
    for clk in range(1, 9):
        out = [await bridge.clk(0b10) for _ in range(clk)] + [await bridge.clk(0b11) for _ in range(30)]
        assert not any(gates[0] for gates in out) and out[-1] == BRAKES


@cocotb.test()
async def reset_in_mid_flow(dut):
    bridge = await Bridge(dut).reset(dead_time=4, minimum_pulse=30)
    for wait in (1, 3, 4, 5, 6, 20):
        await bridge.run(wait, 0b10)
        assert await bridge.clk(rst=1) == COASTS
        assert await bridge.clk() == COASTS


@cocotb.test()
async def any_levels_match_the_model(dut):
    bridge = await Bridge(dut).reset()
    for _ in range(12_000):
        inputs = {}
        if random.randrange(4) == 0:
            inputs["levels"] = random.getrandbits(2)
        if random.randrange(60) == 0:
            inputs.update(fast_decay=random.getrandbits(1), brake=int(random.randrange(4) == 0))
        if random.randrange(200) == 0:
            inputs.update(dead_time=random.choice((0, 1, 2, 5, 20)), minimum_pulse=random.choice((0, 1, 2, 5, 30)))
        await bridge.clk(rst=int(random.randrange(2000) == 0), **inputs)


def test_bridge_gates():
    run("bridge_gates", __file__)

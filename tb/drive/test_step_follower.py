# SPDX-License-Identifier: Apache-2.0
"""step_follower: positions by hand, when it restarts the generator, reset in a calculation, and
random inputs against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly, Timer

from tb.bench import run, start
from tb.drive.step_follower import StepFollower

IDLE = dict(ratio=0, shift=0, enable=0, rebase=0, tick=0, target=0, trim=0)
ONE = 1 << 32  # a step per period
LATENCY = 57


class Follower:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.inputs = dut, StepFollower(), dict(IDLE)

    async def reset(self, **inputs):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        self.inputs.update(inputs)
        return self

    async def clk(self, rst=0, **inputs):
        """Advance one cycle. Strobes last for this cycle, levels stay."""
        self.inputs.update(inputs)
        for name, level in [*self.inputs.items(), ("rst", rst)]:
            getattr(self.dut, name).value = level
        await FallingEdge(self.dut.clk)
        await ReadOnly()
        want = self.model.clk(rst, **self.inputs)
        got = dict(
            go=int(self.dut.go.value),
            restart=int(self.dut.restart.value),
            position=self.dut.position.value.to_signed(),
        )
        assert got == want, f"{self.inputs}: {got}, the model has {want}"
        self.inputs.update(tick=0, rebase=0)
        await Timer(1, "step")
        return got

    async def tick(self, at_clk=None, **inputs):
        """Return the strobe that a tick leads to, its position, and the cycles that it took;
        `inputs` come in cycle `at_clk` after the tick.
        """
        for clk in range(1, 100):
            now = inputs if clk - 1 == at_clk else {}
            got = await self.clk(tick=clk == 1, **now)
            if got["go"] or got["restart"]:
                return ("go" if got["go"] else "restart"), got["position"], clk
        return None


@cocotb.test()
async def latency_is_57_and_position_is_target_plus_trim_in_steps(dut):
    follower = await Follower(dut).reset(enable=1, ratio=5 * ONE // 2, target=3 << 16)
    assert await follower.tick() == ("restart", 15 << 15, LATENCY)
    assert await follower.tick() == ("go", 15 << 15, LATENCY)
    follower.inputs.update(target=-7, ratio=-ONE)
    assert await follower.tick() == ("go", 7, LATENCY)
    follower.inputs.update(trim=-32768, shift=15, target=0)
    assert (await follower.tick())[1] == 1 << 30
    follower.inputs.update(trim=32767, shift=0)
    assert (await follower.tick())[1] == -32767


@cocotb.test()
async def target_is_taken_in_the_8th_cycle_after_the_tick(dut):
    follower = await Follower(dut).reset(enable=1, ratio=ONE, target=1)
    assert (await follower.tick(8, target=2))[1] == 2 and (await follower.tick(9, target=3))[1] == 2


@cocotb.test()
async def it_restarts_after_a_rebase_whenever_it_comes(dut):
    follower = await Follower(dut).reset(enable=1, ratio=ONE)
    for at in [*range(0, LATENCY - 1), None]:
        await follower.tick()
        assert (await follower.tick())[0] == "go"
        if at is None:
            await follower.clk(rebase=1)
        else:
            assert (await follower.tick(at, rebase=1))[0] == "restart"
        if at is None or at >= 8:  # the position was taken before: the next one restarts again
            assert (await follower.tick())[0] == "restart"
        assert (await follower.tick())[0] == "go"


@cocotb.test()
async def no_go_comes_with_the_drive_off_and_it_restarts_with_the_drive_on(dut):
    follower = await Follower(dut).reset(enable=1, ratio=ONE)
    await follower.tick()
    follower.inputs.update(enable=0, target=9 << 16)
    assert [(await follower.tick())[0] for _ in range(3)] == ["restart"] * 3
    follower.inputs.update(enable=1)
    assert [(await follower.tick())[0] for _ in range(2)] == ["restart", "go"]


@cocotb.test()
async def reset_in_a_calculation_drops_the_position(dut):
    follower = await Follower(dut).reset(enable=1, ratio=ONE)
    await follower.tick()
    await follower.clk(tick=1)
    for _ in range(30):
        await follower.clk()
    await follower.clk(1)
    for _ in range(80):
        got = await follower.clk()
        assert not got["go"] and not got["restart"]
    assert (await follower.tick())[0] == "restart"


@cocotb.test()
async def any_input_matches_the_model(dut):
    follower, since = await Follower(dut).reset(), 0
    for _ in range(6000):
        since = 0 if since > 56 and random.random() < 0.1 else since + 1
        follower.inputs.update(
            ratio=random.randrange(-1 << 47, 1 << 47),
            target=random.randrange(-1 << 47, 1 << 47),
            trim=random.randrange(-1 << 15, 1 << 15),
            shift=random.randrange(16),
        )
        await follower.clk(
            int(random.random() < 0.002),
            tick=int(since == 0),
            enable=int(random.random() < 0.995),
            rebase=int(random.random() < 0.01),
        )


def test_step_follower():
    run("step_follower", __file__)

# SPDX-License-Identifier: Apache-2.0
"""set_point_axis: a stream by hand, each way in which it ends, and random strobes against the model
in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.control import set_point_axis as model_of
from tb.control.set_point_axis import HOLD, LATE, LEVELS, MARGIN, STROBES, SetPointAxis

LINES = ("tick", "allowed", "enabled", "stops", "waiting", "dropped", "ticks", "reason")
MOVING, RESTING = (1, 0, 0), (0, 0, 0)  # states of the engine


class Axis:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, SetPointAxis()
        self.inputs = dict.fromkeys(LINES, 0) | dict(allowed=1, enabled=1)

    async def reset(self):
        names = (*LINES, *STROBES, "state_valid", "moving", "braking", "queued", "refused", "cause")
        await start(self.dut, **dict.fromkeys(names, 0))
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, *strobes, rst=0, state=None, cause=None, **inputs):
        dut, model = self.dut, self.model
        lines = self.inputs | inputs
        dut.rst.value = rst
        for name, level in lines.items():
            getattr(dut, name).value = level
        for name in STROBES:
            getattr(dut, name).value = int(name in strobes)
        dut.state_valid.value = int(state is not None)
        for name, level in zip(("moving", "braking", "queued"), state or (0, 0, 0)):
            getattr(dut, name).value = level
        dut.refused.value, dut.cause.value = int(cause is not None), cause or 0
        await FallingEdge(dut.clk)
        waiting = lines.pop("waiting")
        model.clk(rst=rst, state=state, cause=cause, strobes=strobes, **lines)
        want = model.levels(lines["allowed"], waiting)
        found = {name: int(getattr(dut, name).value) for name in LEVELS}
        assert found == want
        return found

    async def to_begin(self):
        """The axis is at rest, and its stream begins."""
        found = await self.clk(state=RESTING)
        assert found["begins"] and not found["active"]
        await self.clk("began")
        await self.clk("pushed", ticks=HOLD, state=(0, 0, 1))
        return await self.clk(state=MOVING)

    def field(self, low, width=3):
        return int(self.dut.state.value) >> low & (1 << width) - 1


@cocotb.test()
async def latency_is_1_and_ahead_counts_the_ticks_that_are_queued(dut):
    axis = await Axis(dut).reset()
    found = await axis.to_begin()
    assert found["anchored"] and found["ahead"] == HOLD and axis.field(0) == model_of.PREPARED
    for left in range(HOLD - 1, -1, -1):
        found = await axis.clk(tick=1)
        assert found["ahead"] == left and found["ending"] == (left <= MARGIN)
    assert (await axis.clk("accepted", "pushed", ticks=20, tick=1))["ahead"] == 20
    assert axis.field(0) == model_of.STREAMING and int(dut.counts.value) == 1
    await axis.clk("extended", "pushed", ticks=2)
    assert axis.field(0) == model_of.EXTRAPOLATING and axis.field(16, 16) == 2


@cocotb.test()
async def ahead_holds_a_full_queue_of_the_longest_pieces(dut):
    """16 that are queued, and one that is being played."""
    axis = await Axis(dut).reset()
    await axis.to_begin()
    for _ in range(17):
        found = await axis.clk("accepted", "pushed", ticks=255)
    assert found["ahead"] == HOLD + 17 * 255 and not found["ending"]


@cocotb.test()
async def a_stream_ends_at_once_and_asks_for_a_stop(dut):
    axis = await Axis(dut).reset()
    for why, ended in (
        (dict(enabled=0), model_of.FAULT),
        (dict(stops=1), model_of.STOPPED),
        (dict(stops=1, enabled=0), model_of.FAULT),
        (dict(state=(1, 1, 0)), model_of.FAULT),
        (dict(state=RESTING), model_of.FAULT),
        (dict(quits=1), model_of.ENDED_LATE),
    ):
        await axis.to_begin()
        strobes = ("quits",) if why.pop("quits", 0) else ()
        found = await axis.clk(*strobes, reason=model_of.ENDED_LATE, **why)
        assert found["stop_due"] and found["streamed"] and not found["active"]
        assert (axis.field(0), axis.field(3)) == (model_of.ENDED, ended)
        # it does not begin again while it is allowed, and not before the stop
        await axis.clk("looked", "stopped", state=RESTING)
        assert not (await axis.clk())["begins"]
        await axis.clk(allowed=0)


@cocotb.test()
async def a_release_ends_without_a_stop(dut):
    axis = await Axis(dut).reset()
    await axis.to_begin()
    found = await axis.clk("released", "pushed", ticks=1, allowed=0)
    assert not found["stop_due"] and not found["streamed"]
    assert (axis.field(0), axis.field(3)) == (model_of.OFF, model_of.RELEASED)
    assert not (await axis.clk())["begins"]  # it still moves
    assert (await axis.clk(state=RESTING))["begins"]


@cocotb.test()
async def each_set_point_is_counted_once(dut):
    axis = await Axis(dut).reset()
    await axis.to_begin()
    await axis.clk("accepted", "pushed", ticks=4)
    await axis.clk(cause=LATE)
    await axis.clk(cause=model_of.LIMITS, dropped=1)
    assert int(dut.counts.value) == 1 | 1 << 16 | 2 << 24
    assert axis.field(6) == model_of.QUEUE_FULL
    await axis.clk(state=(1, 0, 15), waiting=3)
    assert axis.field(9, 5) == 0
    assert (await axis.clk(state=(1, 0, 16)))["full"]


@cocotb.test()
async def random_strobes_match_the_model(dut):
    axis = await Axis(dut).reset()
    alone = ("began", "accepted", "extended", "released", "quits")
    for _ in range(6000):
        strobes = [n for n in ("looked", "pushed", "stopped") if random.random() < 0.2]
        if random.random() < 0.3:
            strobes.append(random.choice(alone))
        axis.inputs["allowed"] ^= random.random() < 0.05
        await axis.clk(
            *strobes,
            rst=int(random.random() < 0.003),
            tick=int(random.random() < 0.1),
            enabled=int(random.random() < 0.98),
            stops=int(random.random() < 0.02),
            waiting=random.randrange(4),
            dropped=int(random.random() < 0.05),
            ticks=random.getrandbits(8),
            reason=random.randrange(1, 5),
            cause=random.randrange(1, 8) if random.random() < 0.1 else None,
            state=random.choice(
                (None, None, MOVING, RESTING, (1, random.getrandbits(1), random.randrange(17)))
            ),
        )


def test_set_point_axis():
    run("set_point_axis", __file__, HOLD=HOLD, MARGIN=MARGIN)

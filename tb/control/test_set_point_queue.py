# SPDX-License-Identifier: Apache-2.0
"""set_point_queue: commits by hand, incomplete and dropped ones, and random words against the model
in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.control.set_point_queue import LIMITS, MOST, WORDS, SetPointQueue, address_of

IDLE = dict(stores=0, stored_at=0, stored_value=0, wdata_low=0, taken=0, read_axis=0, read_word=0)
NAMES = dict(stored_at="at", stored_value="value", wdata_low="low")  # as in the model


class Queue:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.axes = dut, int(dut.AXES.value)
        self.model = SetPointQueue(self.axes)

    async def reset(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        dut, model, inputs = self.dut, self.model, IDLE | inputs
        dut.rst.value = rst
        for name, level in inputs.items():
            getattr(dut, name).value = level
        await FallingEdge(dut.clk)
        model.clk(rst=rst, **{NAMES.get(name, name): level for name, level in inputs.items()})
        for name in ("late_limit", "allowed", "dropped"):
            assert int(getattr(dut, name).value) == getattr(model, name), name
        assert int(dut.waiting.value) == len(model.commits)
        if model.commits:
            found = [int(getattr(dut, name).value) for name in ("tick", "axes", "complete")]
            assert found == list(model.oldest[1:])
        if model.stored is not None:
            assert dut.stored.value.to_signed() == model.stored

    async def write(self, register, value, axis=None, low=0):
        block = "node" if axis is None else "axis"
        await self.clk(
            stores=1,
            stored_at=address_of(block, register, axis or 0),
            stored_value=value & 0xFFFF_FFFF,
            wdata_low=low,
        )

    async def set_point(self, axis, position, velocity):
        await self.write("set_point_position", position >> 32, axis, position & 0xFFFF_FFFF)
        await self.write("set_point_velocity", velocity, axis)

    async def read(self, axis, word):
        await self.clk(read_axis=axis, read_word=word)
        return self.dut.stored.value.to_signed()


@cocotb.test()
async def latency_is_1_from_a_word_to_its_effect(dut):
    queue = await Queue(dut).reset()
    last = queue.axes - 1
    await queue.write("late_limit", 400)
    await queue.write("stream_axes", 1 << last)
    assert (int(dut.late_limit.value), int(dut.allowed.value)) == (400, 1 << last)
    await queue.write("stream_travel_low", -1, last, 5)
    await queue.set_point(last, -(1 << 40) + 3, -7)
    await queue.write("set_point_tick", 1000)
    await queue.write("set_point_commit", 1 << last)
    assert int(dut.waiting.value) == 1
    assert int(dut.tick.value) == 1000 and int(dut.complete.value) == 1 << last
    assert await queue.read(last, 0) == -(1 << 40) + 3
    assert await queue.read(last, 1) == -7
    assert await queue.read(last, 4) == 5 - (1 << 32)


@cocotb.test()
async def a_set_point_that_was_not_written_in_full_is_incomplete(dut):
    queue = await Queue(dut).reset()
    await queue.set_point(0, 1, 1)
    await queue.write("set_point_commit", 1)
    await queue.write("set_point_velocity", 2, 0)
    await queue.write("set_point_commit", 1)
    await queue.write("set_point_position", 0, 0, 4)
    await queue.write("set_point_commit", 1)
    complete = []
    for _ in range(MOST):
        complete.append(int(dut.complete.value))
        await queue.clk(taken=1)
    assert complete == [1, 0, 0]


@cocotb.test()
async def a_commit_without_room_is_dropped_and_one_of_no_axis_is_none(dut):
    queue = await Queue(dut).reset()
    await queue.write("set_point_commit", 0)
    assert int(dut.waiting.value) == 0
    for n in range(MOST + 1):
        await queue.set_point(0, n, n)
        await queue.write("set_point_commit", 1)
        assert int(dut.dropped.value) == (n == MOST)
    for n in range(MOST):
        assert await queue.read(0, 0) == n and await queue.read(0, 1) == n
        await queue.clk(taken=1)
    assert int(dut.waiting.value) == 0


@cocotb.test()
async def words_at_the_same_place_of_other_blocks_are_not_those_of_the_node(dut):
    queue = await Queue(dut).reset()
    await queue.write("late_limit", 400)
    for block in range(1, 256):
        for name in ("late_limit", "stream_axes", "set_point_commit"):
            at = address_of("node", name) + 64 * block
            await queue.clk(stores=1, stored_at=at, stored_value=1)
    assert int(dut.late_limit.value) == 400
    assert not int(dut.allowed.value) and not int(dut.waiting.value)


@cocotb.test()
async def random_words_match_the_model(dut):
    queue = await Queue(dut).reset()
    node = [*queue.model.of_node]
    known = [*queue.model.of_axis]
    for _ in range(4000):
        at = random.choice((random.choice(node), random.choice(known), random.getrandbits(14)))
        word = random.choice([0, 1, *range(LIMITS, len(WORDS))])
        await queue.clk(
            rst=int(random.random() < 0.002),
            stores=int(random.random() < 0.7),
            stored_at=at,
            stored_value=random.getrandbits(32),
            wdata_low=random.getrandbits(32),
            taken=int(queue.model.commits != [] and random.random() < 0.2),
            read_axis=random.randrange(queue.axes),
            read_word=word,
        )


@pytest.mark.parametrize("axes", [1, 3, 8])
def test_set_point_queue(axes):
    run("set_point_queue", __file__, AXES=axes)

# SPDX-License-Identifier: Apache-2.0
"""sync_fifo: the order of the words, an empty and a full queue, the latency, overruns, and random
traffic against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.sync_fifo import SyncFifo


class Queue:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.w, self.depth = dut, int(dut.W.value), int(dut.DEPTH.value)
        self.model = SyncFifo(self.depth)
        self.input = getattr(dut, "in")  # `in` is a keyword of Python

    async def clk(self, push=0, word=0, pop=0, rst=0):
        dut = self.dut
        dut.push.value, self.input.value, dut.pop.value, dut.rst.value = push, word, pop, rst
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        present = int(dut.present.value)
        got = (
            present,
            int(dut.out.value) if present else None,
            int(dut.free.value),
            int(dut.overrun.value),
        )
        want = self.model.step(push, word, pop, rst)
        assert got == want, f"(present, out, free, overrun) is {got}, the model has {want}"
        return got


async def begin(dut):
    await start(dut, push=0, pop=0, **{"in": 0})
    queue = Queue(dut)
    await queue.clk(rst=1)
    return queue


async def drained(queue):
    """The words that are popped, one in two cycles, until the queue is empty."""
    words = []
    while (got := await queue.clk())[0]:
        words.append(got[1])
        await queue.clk(pop=1)
    return words


@cocotb.test()
async def latency_is_2_from_push_and_from_pop_to_present(dut):
    queue = await begin(dut)
    assert (await queue.clk(push=1, word=5))[0] == 0
    assert (await queue.clk())[:2] == (1, 5)
    assert (await queue.clk())[:2] == (1, 5)
    await queue.clk(push=1, word=3)
    assert (await queue.clk(pop=1))[0] == 0
    assert (await queue.clk())[:2] == (1, 3)


@cocotb.test()
async def words_come_out_in_the_order_in_which_they_went_in(dut):
    queue = await begin(dut)
    words = [n * 7 % (1 << queue.w) for n in range(queue.depth)]
    for word in words:
        await queue.clk(push=1, word=word)
    assert await drained(queue) == words


@cocotb.test()
async def a_word_for_a_full_queue_is_dropped_and_reported_and_the_others_stay(dut):
    queue = await begin(dut)
    for n in range(queue.depth):
        assert (await queue.clk(push=1, word=n % 4))[2:] == (queue.depth - 1 - n, 0)
    assert (await queue.clk(push=1, word=3))[2:] == (0, 1)
    # the queue was full when the word came
    assert (await queue.clk(push=1, word=3, pop=1))[2:] == (1, 1)
    assert (await queue.clk())[2:] == (1, 0)
    assert await drained(queue) == [n % 4 for n in range(1, queue.depth)]


@cocotb.test()
async def pop_of_an_empty_queue_does_nothing(dut):
    queue = await begin(dut)
    for _ in range(3):
        assert await queue.clk(pop=1) == (0, None, queue.depth, 0)
    await queue.clk(push=1, word=6, pop=1)
    assert (await queue.clk(pop=1))[:2] == (1, 6)


@cocotb.test()
async def one_push_per_cycle_and_one_pop_in_two_cycles_are_possible(dut):
    queue = await begin(dut)
    for n in range(queue.depth):
        await queue.clk(push=1, word=n % 4, pop=0)
    for n in range(3 * queue.depth):
        assert (await queue.clk(pop=1))[0] == 0
        assert (await queue.clk(push=1, word=n % 4))[:2] == (1, (n + 1) % 4)


@cocotb.test()
async def reset_empties_the_queue(dut):
    queue = await begin(dut)
    for n in range(5):
        await queue.clk(push=1, word=n % 4)
    assert await queue.clk(rst=1) == (0, None, queue.depth, 0)
    assert (await queue.clk())[0] == 0


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    queue = await begin(dut)
    for _ in range(40):
        fill, drain = random.random(), random.random()
        for _ in range(100):
            rst = int(random.random() < 0.001)
            await queue.clk(
                int(random.random() < fill),
                random.getrandbits(queue.w),
                int(random.random() < drain),
                rst,
            )


@pytest.mark.parametrize("w, depth", [(3, 4), (11, 64)])
def test_sync_fifo(w, depth):
    run("sync_fifo", __file__, W=w, DEPTH=depth)

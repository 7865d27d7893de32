# SPDX-License-Identifier: Apache-2.0
"""ps2_inject_queue: order, what a drop takes back and what it leaves, and random traffic with a
reader as ps2_arbiter is one.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.peripheral.ps2_inject_queue import Ps2InjectQueue

CUT = [(0x14, 0), (0x1D, 0), (0xF0, 0), (0x1D, 0), (0xF0, 0), (0x14, 1)]


class Queue:
    """The queue with a reader. `begins` lets the reader begin a waiting sequence, `reads` take a
    code of the sequence that has begun.
    """

    def __init__(self, dut):
        self.dut, self.model, self.injecting, self.sent = (
            dut,
            Ps2InjectQueue(int(dut.DEPTH.value)),
            0,
            [],
        )
        self.input = getattr(dut, "in")  # a keyword of Python

    async def clk(self, push=None, drop=0, begins=0, reads=0, rst=0):
        """Returns (valid, free) of this cycle."""
        dut = self.dut
        dut.push.value, dut.drop.value, dut.rst.value, dut.injecting.value = (
            push is not None,
            drop,
            rst,
            self.injecting,
        )
        self.input.value, dut.in_last.value = push or (0, 0)
        dut.ready.value = 0
        await Timer(1, "ns")
        valid = int(dut.valid.value)
        got = (
            valid,
            (int(dut.out.value), int(dut.last.value)) if valid else None,
            int(dut.free.value),
        )
        want = self.model.outputs(self.injecting)
        assert got == want, f"(valid, code, free) is {got}, the model has {want}"
        ready = int(bool(reads and valid and self.injecting))
        dut.ready.value = ready
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.model.step(push, drop, ready, self.injecting, rst)
        if rst:
            self.injecting = 0
        elif ready:
            self.sent.append(got[1])
            self.injecting = int(not got[1][1])
        elif begins and valid:
            self.injecting = 1
        return got[0], got[2]

    async def put(self, codes):
        for code in codes:
            await self.clk(code)

    async def read_all(self):
        for _ in range(2 * self.model.depth + 8):
            await self.clk(begins=1, reads=1)
        return self.sent


async def begin(dut):
    await start(dut, push=0, drop=0, ready=0, injecting=0, in_last=0, **{"in": 0})
    queue = Queue(dut)
    await queue.clk(rst=1)
    return queue


@cocotb.test()
async def latency_is_2_from_push_to_valid(dut):
    queue = await begin(dut)
    await queue.clk((5, 1))
    assert [(await queue.clk())[0] for _ in range(3)] == [0, 1, 1]


@cocotb.test()
async def codes_come_out_in_the_order_in_which_they_went_in(dut):
    queue = await begin(dut)
    await queue.put(CUT * 5)
    assert await queue.read_all() == CUT * 5


@cocotb.test()
async def a_drop_takes_back_all_that_waits(dut):
    queue = await begin(dut)
    await queue.put(CUT * 5)
    await queue.clk(drop=1)
    seen = [await queue.clk(begins=1, reads=1) for _ in range(62)]
    assert not any(valid for valid, _ in seen) and seen[-1][1] == 32 and queue.sent == []


@cocotb.test()
async def a_sequence_that_is_under_way_is_finished_whole_and_those_behind_it_go(dut):
    for sent in range(6):
        queue = await begin(dut)
        await queue.put(CUT * 3)
        await queue.clk(begins=1)
        for _ in range(sent):
            await queue.clk(reads=1)
        await queue.clk(drop=1)
        assert await queue.read_all() == CUT and (await queue.clk())[1] == 32


@cocotb.test()
async def a_sequence_that_begins_in_the_clk_of_the_drop_is_under_way(dut):
    queue = await begin(dut)
    await queue.put(CUT * 2)
    await queue.clk(drop=1, begins=1)
    assert await queue.read_all() == CUT


@cocotb.test()
async def what_comes_after_a_drop_stays(dut):
    later = [(0x55, 0), (0x66, 1)]
    queue = await begin(dut)
    await queue.put(CUT * 3)
    await queue.clk(begins=1)
    await queue.clk(later[0], drop=1)  # even in its cycle
    await queue.clk(later[1])
    assert await queue.read_all() == CUT + later
    await queue.put(CUT * 2)
    await queue.clk(drop=1)
    await queue.put(later)
    assert await queue.read_all() == (CUT + later) + later


@cocotb.test()
async def a_drop_of_nothing_does_nothing(dut):
    queue = await begin(dut)
    await queue.clk(drop=1)
    await queue.put(CUT)
    assert await queue.read_all() == CUT


@cocotb.test()
async def reset_in_the_middle_of_a_drop_empties_it(dut):
    queue = await begin(dut)
    await queue.put(CUT * 5)
    await queue.clk(drop=1)
    await queue.clk()
    await queue.clk(rst=1)
    assert (await queue.clk())[1] == 32
    await queue.put(CUT)
    assert await queue.read_all() == CUT


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    queue = await begin(dut)
    for _ in range(60):
        fill, drain, starts, drops = (
            random.random(),
            random.random(),
            random.random(),
            random.random() * 0.1,
        )
        for _ in range(100):
            push = (
                (random.getrandbits(8), int(random.random() < 0.3))
                if random.random() < fill
                else None
            )
            await queue.clk(
                push,
                int(random.random() < drops),
                int(random.random() < starts),
                int(random.random() < drain),
                int(random.random() < 0.001),
            )


@pytest.mark.parametrize("depth", [32])
def test_ps2_inject_queue(depth):
    run("ps2_inject_queue", __file__, DEPTH=depth)

# SPDX-License-Identifier: Apache-2.0
"""engine_memory: the constants of every axis, and random accesses against the model."""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from tb.bench import run
from tb.control.engine_memory import EngineMemory


class Memory:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut = dut
        self.model = EngineMemory(int(dut.AXES.value), int(dut.WORD_W.value))

    async def clk(self, read_at=0, write=0, write_at=0, word=0):
        dut = self.dut
        dut.read_at.value, dut.write.value = read_at, write
        dut.write_at.value, dut.word.value = write_at, word
        want = self.model.clk(read_at, write, write_at, word)
        await FallingEdge(dut.clk)
        assert int(dut.stored.value) == want, f"word {read_at}"
        return want


async def begin(dut):
    Clock(dut.clk, 10, "ns", impl="gpi").start()
    await FallingEdge(dut.clk)
    return Memory(dut)


@cocotb.test()
async def latency_is_1_and_every_word_is_as_at_power_up(dut):
    memory = await begin(dut)
    for at in range(len(memory.model.words)):
        await memory.clk(read_at=at)


@cocotb.test()
async def random_accesses_match_the_model(dut):
    memory = await begin(dut)
    size = len(memory.model.words)
    for at in range(size):
        memory.model.words[at] = word = random.getrandbits(72)
        dut.write.value, dut.write_at.value, dut.word.value = 1, at, word
        await FallingEdge(dut.clk)
    for _ in range(3000):
        at, other = random.sample(range(size), 2)
        await memory.clk(at, random.getrandbits(1), other, random.getrandbits(72))


@pytest.mark.parametrize("axes, word_w", [(1, 7), (3, 8)])
def test_engine_memory(axes, word_w):
    run("engine_memory", __file__, AXES=axes, WORD_W=word_w)

# SPDX-License-Identifier: Apache-2.0
"""Our models of the primitives of the ECP5 that Yosys has none of: memories of every width of the
block RAM, with their first contents, and products, as Yosys maps them, against plain integers.
"""

import random

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from tb.bench import needs, run
from twin import netlist

WORDS_OF = {1: 16384, 2: 8192, 4: 4096, 9: 2048, 18: 1024, 36: 512}


@cocotb.test()
async def any_accesses_match_a_list(dut):
    needs(hasattr(dut, "DEPTH"), "the bench is the multiplier's")
    width, depth = int(dut.W.value), int(dut.DEPTH.value)
    words = [(n * 40503 >> 3) % 2**width for n in range(depth)]
    dut.write.value = dut.read.value = 0
    Clock(dut.clk, 10, "ns").start(start_high=False)
    await FallingEdge(dut.clk)
    few = random.sample(range(depth), 8)
    for n in range(1000):
        at, data = random.choice(few), random.getrandbits(width)
        write = random.getrandbits(1)
        read_at = few[n % 8] if n < 500 else random.randrange(depth)
        dut.write.value, dut.write_at.value, dut.data.value = write, at, data
        dut.read.value, dut.read_at.value = 1, read_at
        await FallingEdge(dut.clk)
        assert int(dut.word.value) == words[read_at], (n, read_at, write and at == read_at)
        if write:
            words[at] = data
    dut.read.value, held = 0, int(dut.word.value)
    dut.read_at.value = few[0]
    await FallingEdge(dut.clk)
    assert int(dut.word.value) == held


@cocotb.test()
async def products_are_exact(dut):
    needs(not hasattr(dut, "DEPTH"), "the bench is the memory's")
    ends = [0, 1, 2**17 - 1, 2**17, 2**18 - 1]
    pairs = [(a, b) for a in ends for b in ends]
    pairs += [(random.getrandbits(18), random.getrandbits(18)) for _ in range(500)]
    for a, b in pairs:
        dut.a.value, dut.b.value = a, b
        await Timer(1, "ns")
        signed_a, signed_b = (x - (x >> 17 << 18) for x in (a, b))
        assert int(dut.product.value) == a * b
        assert dut.signed_product.value.to_signed() == signed_a * signed_b


def primitive_is_used(name):
    made = [path for path in netlist.BUILD.glob("ecp5/*_bench-*/netlist.v")]
    return any(f"  {name} " in path.read_text() for path in made)


@pytest.mark.parametrize("w", WORDS_OF)
def test_block_ram(w, monkeypatch):
    monkeypatch.setenv("NETLIST", "ecp5")
    run("block_ram_bench", __file__, W=w, DEPTH=WORDS_OF[w])
    assert primitive_is_used("DP16KD")


def test_multiplier(monkeypatch):
    monkeypatch.setenv("NETLIST", "ecp5")
    run("multiplier_bench", __file__)
    assert primitive_is_used("MULT18X18D")

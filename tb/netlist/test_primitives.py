# SPDX-License-Identifier: Apache-2.0
"""Our models of the primitives of ECP5 and Gowin parts that Yosys has none of: memories of every
width of the block RAM, with their first contents, and products, as Yosys maps them, against plain
integers.
"""

import random
import subprocess

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from tb.bench import ROOT, needs, run
from twin import netlist

WORDS_OF = {1: 16384, 2: 8192, 4: 4096, 9: 2048, 18: 1024, 36: 512}


def contents(width, depth):
    return [(n * 40503 >> 3) % 2**width for n in range(depth)]


@cocotb.test()
async def any_accesses_match_a_list(dut):
    needs(hasattr(dut, "DEPTH"), "the bench is the multiplier's")
    width, depth = int(dut.W.value), int(dut.DEPTH.value)
    words = contents(width, depth)
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


def primitive_is_used(name, family="ecp5"):
    made = [path for path in netlist.BUILD.glob(f"{family}/*_bench-*/netlist.v")]
    return any(f"  {name} " in path.read_text() for path in made)


def block_ram(w, family, monkeypatch):
    """The memory of w bits on the netlist of a family."""
    monkeypatch.setenv("NETLIST", family)
    file = ROOT / "build" / f"block_ram_{family}_{w}.hex"
    file.write_text("".join(f"{word:x}\n" for word in contents(w, WORDS_OF[w])))
    run("block_ram_bench", __file__, W=w, DEPTH=WORDS_OF[w], CONTENTS=str(file))


@pytest.mark.parametrize("w", WORDS_OF)
def test_block_ram(w, monkeypatch):
    block_ram(w, "ecp5", monkeypatch)
    assert primitive_is_used("DP16KD")


@pytest.mark.parametrize(
    "w, primitive", [(1, "DPB"), (4, "DPB"), (9, "DPX9B"), (18, "DPX9B"), (36, "SDPX9B")]
)
def test_block_ram_of_a_gowin_part(w, primitive, monkeypatch):
    block_ram(w, "gowin", monkeypatch)
    assert primitive_is_used(primitive, "gowin")


@pytest.mark.parametrize("family, primitive", [("ecp5", "MULT18X18D"), ("gowin", "MULT18X18")])
def test_multiplier(family, primitive, monkeypatch):
    monkeypatch.setenv("NETLIST", family)
    run("multiplier_bench", __file__)
    assert primitive_is_used(primitive, family)


COLLISION = """
module collision;
    reg clk = 0, write = 0;
    reg [9:0] at = 0, read_at = 0;
    wire [17:0] word;
    DP16KD #(.DATA_WIDTH_A(18), .DATA_WIDTH_B(18), .INITVAL_00(320'h2AAAA)) memory (
        .CLKA(clk), .CLKB(clk), .CEA(1'b1), .CEB(1'b1), .OCEB(1'b1), .WEA(write), .WEB(1'b0),
        .RSTA(1'b0), .RSTB(1'b0), .CSA0(1'b0), .CSA1(1'b0), .CSA2(1'b0),
        .CSB0(1'b0), .CSB1(1'b0), .CSB2(1'b0), .ADA0(1'b1), .ADA1(1'b0),
        PORTS
    );
    task cycle(input writes, input [9:0] to, input [9:0] from);
        begin
            write = writes; at = to; read_at = from;
            #5 clk = 1; #5 clk = 0;
            $display("%b", word);
        end
    endtask
    initial begin
        cycle(0, 0, 0);  // the first contents
        cycle(1, 0, 0);  // the lower byte is written while it is read
        cycle(1, 0, 1);  // another word is read
        cycle(0, 0, 0);  // the lower byte has become ones
    end
endmodule
"""


def test_a_word_that_is_read_while_it_is_written_is_unknown(tmp_path):
    ports = [f".ADA{n + 4}(at[{n}]), .ADB{n + 4}(read_at[{n}])" for n in range(10)]
    ports += [f".DIA{n}(1'b1), .DOB{n}(word[{n}])" for n in range(18)]
    bench, program = tmp_path / "bench.v", tmp_path / "bench.vvp"
    bench.write_text(netlist.primitives("ecp5") + COLLISION.replace("PORTS", ", ".join(ports)))
    command = ["iverilog", "-g2012", "-s", "collision", "-o", str(program), str(bench)]
    subprocess.run(command, check=True)
    printed = subprocess.run(["vvp", "-n", str(program)], capture_output=True, text=True).stdout
    first = f"{0x2AAAA:018b}"
    assert printed.split() == [first, first[:9] + "x" * 9, "0" * 18, first[:9] + "1" * 9]

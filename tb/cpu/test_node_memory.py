# SPDX-License-Identifier: Apache-2.0
"""node_memory: the contents at power-up, single bytes, both ends, random accesses; and block RAM in
synthesis.
"""

import random
import re
import subprocess
import sys
from importlib.util import find_spec

import cocotb
import pytest
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import ROOT, run
from tb.cpu.node_memory import NodeMemory
from tb.simulator import source_of

BYTES = 1024
CONTENTS = [n * 0x9E3779B1 % (1 << 32) for n in range(BYTES // 4)]  # any words, all different


def contents_in(path):
    path.write_text("\n".join(f"{word:08x}" for word in CONTENTS))
    return path


async def clk(dut, write, write_address, wdata, read_address):
    dut.write.value, dut.write_address.value, dut.wdata.value, dut.read_address.value = (
        write,
        write_address,
        wdata,
        read_address,
    )
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return dut.rdata.value


async def read(dut, address):
    return int(await clk(dut, 0, 0, 0, address))


async def begin(dut):
    dut.write.value = 0
    Clock(dut.clk, 10, "ns", impl="gpi").start()
    await FallingEdge(dut.clk)


@cocotb.test()
async def latency_is_1_and_the_file_is_in_the_memory_at_power_up(dut):
    await begin(dut)
    for n, word in enumerate(CONTENTS):
        assert await read(dut, n) == word


@cocotb.test()
async def each_byte_enable_writes_only_its_byte(dut):
    await begin(dut)
    for address in (0, BYTES // 4 - 1):
        await clk(dut, 15, address, 0x03020100, address)
        for write, want in [(1, 0x030201AA), (2, 0x0302BBAA), (4, 0x03CCBBAA), (8, 0xDDCCBBAA)]:
            await clk(dut, write, address, 0xDDCCBBAA, address)
            assert await read(dut, address) == want


@cocotb.test()
async def any_access_matches_the_model(dut):
    await begin(dut)
    model = NodeMemory([0] * (BYTES // 4))
    for n in range(BYTES // 4):
        await clk(dut, 15, n, 0, 0)
    model.step(0, 0, 0, 0)
    await read(dut, 0)
    for n in range(3000):
        word = (
            random.choice([0, 15, random.getrandbits(4)]),
            random.randrange(16),
            random.getrandbits(32),
            random.randrange(16),
        )
        assert int(await clk(dut, *word)) == model.step(*word), f"cycle {n}"


def test_node_memory():
    (ROOT / "build").mkdir(exist_ok=True)
    run(
        "node_memory",
        __file__,
        BYTES=BYTES,
        FIRMWARE=str(contents_in(ROOT / "build" / "node_memory.hex")),
    )


@pytest.mark.skipif(not find_spec("pyosys"), reason="pyosys is not installed")
def test_32_kib_are_16_block_rams_of_an_ecp5_and_hold_the_file(tmp_path):
    """Synthesised in a process of its own: the synthesis library never frees its memory, which
    later tests would then lack.
    """
    file = contents_in(tmp_path / "node_memory.hex")
    script = f"""
from pyosys import libyosys
design = libyosys.Design()
for step in ['read_verilog -sv {source_of("node_memory")}',
             'chparam -set FIRMWARE "{file}" node_memory',
             'synth_ecp5 -top node_memory', 'write_verilog {tmp_path / "netlist.v"}']:
    design.run_pass('tee -q ' + step)
"""
    subprocess.run(
        [sys.executable, "-c", script], check=True, timeout=120, stdout=subprocess.DEVNULL
    )
    netlist = (tmp_path / "netlist.v").read_text()
    assert netlist.count("DP16KD #(") == 16
    assert netlist.count("LUT4 #(") <= 1, "8192 x 2 bits: no selection among the block RAMs"
    assert len(re.findall(r"TRELLIS_FF #\(|TRELLIS_DPR16X4", netlist)) == 0
    assert len(re.findall(r"\.INITVAL_00\(320'h(?=[0-9a-f]*[1-9a-f])", netlist)) == 16

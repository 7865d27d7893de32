# SPDX-License-Identifier: Apache-2.0
"""What the tests of soft_core and serial_core have in common: the compiled program, the results of
its accesses to the memory, and the other side of the register bus.
"""

import random
import subprocess
from pathlib import Path

from cocotb.triggers import FallingEdge, RisingEdge

from firmware import build as firmware_build
from tb.bench import ROOT

MASK = (1 << 32) - 1


def signed(x, w=32):
    return (x & (1 << w) - 1) - (1 << w if x >> w - 1 & 1 else 0)


def operation_results(a, b):
    """The results of operate() in core_program.h, not yet cut to 32 bits."""
    sa, sb, n = signed(a), signed(b), b & 31
    return [a + b, a - b, a & b, a | b, a ^ b, a << n, a >> n, sa >> n, sa < sb, a < b]


def memory_results(a, b):
    """The results of access_memory() in core_program.h."""
    memory = a.to_bytes(4, "little") + b.to_bytes(4, "little")
    halves = [int.from_bytes(memory[k : k + 2], "little") for k in range(0, 8, 2)]
    return [
        *memory,
        *(signed(x, 8) for x in memory),
        *halves,
        *(signed(x, 16) for x in halves),
        *(b, a, b & ~0xFF0000 | 0x5A0000, a & 0xFFFF | 0xA55A0000),
    ]


def content(core, memory_bytes, loaded_bytes, code_bytes=0):
    """Compile tb/cpu/`core`_test.c with the firmware's own tools; the bytes to load into the
    memory, and `code_bytes` for the flash, which has the program without its start if it is not 0.
    """
    here, (command, libraries) = Path(__file__).parent, firmware_build.compiler(core)
    build = ROOT / "build" / f"{core}_core"
    build.mkdir(parents=True, exist_ok=True)
    elf, script = build / "program.elf", build / "program.ld"
    code_at = firmware_build.CODE_AT if code_bytes else 0
    script.write_text(f"CODE = {code_at:#x};\n" + (here / "core_program.ld").read_text())
    subprocess.run(
        [
            *command,
            *firmware_build.FLAGS,
            firmware_build.FAST,
            f"-DMEMORY_BYTES={memory_bytes}",
            f"-Wl,-T,{script}",
            "-o",
            str(elf),
            str(here / f"{core}_test.c"),
            *libraries,
        ],
        check=True,
        timeout=300,
    )
    segments = firmware_build.read_elf(elf)[0]
    code = firmware_build.contents(segments, code_bytes, firmware_build.CODE_AT)[0]
    return firmware_build.contents(segments, loaded_bytes)[0], code


class Registers:
    """The other side of the register bus: answers two cycles after select, and keeps what was
    written.
    """

    def __init__(self, dut):
        self.dut, self.words, self.written, self.strobes = dut, {0: 0, 4: 0, 8: 0}, [], []
        self.answer = None  # to the access of the cycle before

    async def clk(self, rst=0):
        """Advance one cycle; what the bus shows before its clock edge counts. Returns trap."""
        dut = self.dut
        dut.rst.value = rst
        strobe = not rst and str(dut.select.value) == "1"
        self.strobes.append(strobe)
        if strobe:
            address = int(dut.address.value)
            if int(dut.write.value):
                self.written.append((address, int(dut.wdata.value)))
        read = strobe and not int(dut.write.value)
        await RisingEdge(dut.clk)
        dut.rdata.value = random.getrandbits(32) if self.answer is None else self.answer
        self.answer = self.words.get(address, 0) if read else None
        await FallingEdge(dut.clk)
        return str(dut.trap.value) == "1"

    async def until(self, done, clks):
        for n in range(clks):
            if done():
                return n
            await self.clk()
        raise AssertionError(f"the program did not get that far in {clks} cycles")

    def taken(self, address):
        return [value for where, value in self.written if where == address]


async def results_are_right(registers, pairs, results, clks):
    """The program writes the `results` of each pair of operands, in at most so many cycles."""
    count = len(results(0, 0))
    for a, b in pairs:  # each pair is set just after the last result of the pair before
        registers.written.clear()
        registers.words[0], registers.words[4] = a, b
        await registers.until(lambda: len(registers.taken(0xFFFC)) >= count, clks)
        got, want = registers.taken(0xFFFC), results(a, b)
        assert got == want, (
            f"operands {a:#x}, {b:#x}: results "
            f"{[n for n, (g, w) in enumerate(zip(got, want)) if g != w]} are wrong"
        )

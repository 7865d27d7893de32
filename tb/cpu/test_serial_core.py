# SPDX-License-Identifier: Apache-2.0
"""serial_core: a compiled program comes out of a flash, executes every instruction and access width
on operands from the register bus, then makes every wrong access. Its results must be those of
tb/cpu/serial_core.py.
"""

import random
import subprocess
from pathlib import Path

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from firmware import build as firmware_build
from tb.bench import ROOT, run, start
from tb.cpu.serial_core import results
from tb.cpu.test_flash_loader import Flash

BYTES = 4096  # of the memory
PROGRAM = 2048  # bytes that are copied
START = 131072
BUILD = ROOT / "build" / "serial_core"
OPERANDS = [0, 1, 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF]
TRAPS = range(1, 9)  # ORDER in serial_test.c
ROUND = len(results(0, 0))  # results of one round of the program
BOOT = 64 * (64 + PROGRAM // 4 + 2)  # cycles until the core starts


class Registers:
    """The other side of the register bus, which answers two cycles after select, and the flash."""

    def __init__(self, dut):
        self.dut, self.words, self.written, self.strobes = dut, {0: 0, 4: 0, 8: 0}, [], []
        self.answer = None  # to the access of the cycle before
        self.flash = Flash((BUILD / "program.bin").read_bytes() + bytes(1), START)

    async def clk(self, rst=0):
        """Advance one cycle; what the bus shows before its clock edge counts."""
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
        pins = (dut.flash_cs_n, dut.flash_sclk, dut.flash_mosi)
        dut.flash_miso.value = self.flash.step(*(int(pin.value) for pin in pins))
        return str(dut.trap.value) == "1"

    async def until(self, done, clks=30000):
        for n in range(clks):
            if done():
                return n
            await self.clk()
        raise AssertionError(f"the program did not get that far in {clks} cycles")

    def taken(self, address):
        return [value for where, value in self.written if where == address]


async def begin(dut, whole=False):
    """The core runs. The memory keeps the program, so only the first start copies the `whole`
    program, the others the last word again.
    """
    await start(dut, rdata=0, ready=1, flash_miso=1)
    registers = Registers(dut)
    for _ in range(3):
        await registers.clk(rst=1)
    if not whole:
        await registers.clk()
        loader = dut.u_loader
        loader.state.value, loader.count.value, loader.half.value = 3, PROGRAM // 4 - 1, 63
    await registers.until(lambda: registers.taken(0x10), BOOT + 3000)
    return registers


@cocotb.test()
async def every_instruction_and_access_width_has_the_right_result(dut):
    registers = await begin(dut, whole=True)
    assert registers.taken(0x0C) == [BYTES], "the stack begins at the end of the memory"
    assert registers.taken(0x10) == [0x1001], "the data have their first values"
    pairs = [(0, 0), (0xFFFFFFFF, 0x80000000), (0x80000000, 0x7FFFFFFF), (5, 5)]
    pairs += [
        (random.getrandbits(32), random.getrandbits(random.choice([5, 32]))) for _ in range(4)
    ]
    for a, b in pairs:  # each pair is set just after the last result of the pair before
        registers.written.clear()
        registers.words[0], registers.words[4] = a, b
        await registers.until(lambda: len(registers.taken(0xFFFC)) >= ROUND)
        got, want = registers.taken(0xFFFC), results(a, b)
        assert got == want, (
            f"operands {a:#x}, {b:#x}: results "
            f"{[n for n, (g, w) in enumerate(zip(got, want)) if g != w]} are wrong"
        )
    strobes = registers.strobes
    assert not any(a and b for a, b in zip(strobes, strobes[1:])), "an access is one strobe"


@cocotb.test()
async def latency_is_1_wait_cycle_for_memory_and_2_for_a_register(dut):
    """An operation takes 36 to 38 cycles, and all others 66 to 110."""
    registers = await begin(dut)
    waited, times, cycles, last = {}, [], None, 0
    for n in range(5000):
        await registers.clk()
        fetch, data = int(dut.fetch.value), int(dut.load_or_store.value)
        assert not (fetch and data), "the core makes one access at a time"
        if not fetch and not data:
            cycles = 0
        elif cycles is not None and int(dut.done.value):
            kind = "memory" if fetch or int(dut.in_memory.value) else "register"
            waited.setdefault(kind, set()).add(cycles)
            if fetch:
                times.append(n - last)
                last = n
            cycles = 0
        elif cycles is not None:
            cycles += 1
    assert waited == {"memory": {1}, "register": {2}}
    short, long = ({t for t in times[1:] if (t < 60) == less} for less in (True, False))
    assert short and short <= {36, 37, 38} and 66 <= min(long) and max(long) <= 110


@cocotb.test()
async def every_wrong_access_traps_and_reset_starts_the_core_again(dut):
    for order in TRAPS:
        registers = await begin(dut)
        registers.words[8] = order
        await registers.until(lambda: str(dut.trap.value) == "1")
        written = len(registers.written)
        for _ in range(200):
            assert await registers.clk(), f"order {order}: trap must stay high until reset"
        assert len(registers.written) == written, f"order {order}: no access may follow in a trap"
        assert {where for where, _ in registers.written} <= {0x0C, 0x10, 0xFFFC}


@cocotb.test()
async def a_register_access_waits_until_the_registers_are_ready(dut):
    registers = await begin(dut)
    dut.ready.value = 0
    await registers.clk()
    await registers.until(lambda: not any(registers.strobes[-300:]), 5000)
    assert int(dut.load_or_store.value)
    dut.ready.value = 1
    await registers.clk()
    await registers.until(lambda: len(registers.taken(0xFFFC)) >= 5)
    assert not int(dut.trap.value)


def compile_program():
    """Compile the program with the firmware's own tools to the bytes of the flash."""
    here, (command, libraries) = Path(__file__).parent, firmware_build.compiler("serial")
    BUILD.mkdir(parents=True, exist_ok=True)
    elf = BUILD / "program.elf"
    subprocess.run(
        [
            *command,
            *firmware_build.FLAGS,
            firmware_build.FAST,
            f"-DMEMORY_BYTES={BYTES}",
            f"-Wl,-T,{here / 'core_test.ld'}",
            "-o",
            str(elf),
            str(here / "serial_test.c"),
            *libraries,
        ],
        check=True,
        timeout=300,
    )
    content, _ = firmware_build.contents(firmware_build.read_elf(elf)[0], PROGRAM)
    (BUILD / "program.bin").write_bytes(content)


def test_serial_core():
    compile_program()
    run("serial_core", __file__, MEMORY_BYTES=BYTES, PROGRAM_BYTES=PROGRAM, FLASH_START=START)

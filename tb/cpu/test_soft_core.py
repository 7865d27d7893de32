# SPDX-License-Identifier: Apache-2.0
"""soft_core: a compiled program executes every instruction and access width on operands from the
register bus, then makes every wrong access. Its results must be those of tb/cpu/soft_core.py. It
lies in the memory, or all but its start in a flash.
"""

import random
import struct

import cocotb
import pytest

from firmware import build as firmware_build
from tb.bench import ROOT, needs, rtl_only, run, start
from tb.cpu import core_program
from tb.cpu.soft_core import results
from tb.relay.flash import Flash

BYTES = 2048
CODE, CODE_START = 8192, 0x24000  # bytes in the flash, as soft_test.c has it, and where they begin
FLASH = ROOT / "build" / "soft_core" / "code.bin"
LONGEST = {0: 5000, CODE: 50000}  # cycles of a round of the program
OPERANDS = [0, 1, 2, 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF, 0x0000FFFF, 31]
TRAPS = range(1, 16)  # ORDER in soft_test.c
CODE_TRAPS = (12, 14, 15)  # those of the flash; each reset reads it again
ROUND = len(results(0, 0))  # results of one round of the program


class Registers(core_program.Registers):
    """With the flash, if the core has one."""

    def __init__(self, dut):
        super().__init__(dut)
        self.code, self.flash = int(dut.CODE_BYTES.value), Flash()
        if self.code:
            self.flash.memory[CODE_START : CODE_START + CODE] = FLASH.read_bytes()

    @property
    def selects(self):
        return sum(self.strobes)

    async def clk(self, rst=0):
        trap, dut = await super().clk(rst), self.dut
        pins = (dut.flash_cs_n, dut.flash_sclk, dut.flash_mosi)
        dut.flash_miso.value = self.flash.pins(*(int(pin.value) for pin in pins))
        return trap

    async def until(self, done, clks=None):
        return await super().until(done, clks or LONGEST[self.code])


async def begin(dut):
    await start(dut, rdata=0, ready=1, flash_miso=1)
    registers = Registers(dut)
    for _ in range(3):
        await registers.clk(rst=1)
    return registers


@cocotb.test()
async def every_instruction_and_access_width_has_the_right_result(dut):
    registers = await begin(dut)
    pairs = [(a, b) for a in OPERANDS[:6] for b in (0, 0xFFFFFFFF)] + [
        (0x80000000, 31),
        (0x7FFFFFFF, 0x80000000),
    ]
    pairs += [
        (random.getrandbits(32), random.getrandbits(random.choice([5, 16, 32]))) for _ in range(8)
    ]
    await core_program.results_are_right(registers, pairs, results, LONGEST[registers.code])
    assert not int(dut.trap.value)


@cocotb.test()
async def it_starts_with_the_stack_at_the_end_of_the_memory(dut):
    registers = await begin(dut)
    await registers.until(lambda: registers.taken(0x10))
    assert registers.taken(0x0C) == [BYTES]


@cocotb.test()
async def every_wrong_access_traps_and_reset_starts_the_core_again(dut):
    registers = await begin(dut)
    await registers.until(lambda: registers.taken(0x10))
    starts = registers.taken(0x10)[0]
    for order in CODE_TRAPS if registers.code else TRAPS:
        registers.words[8] = order
        await registers.until(lambda: str(dut.trap.value) == "1")
        written, selects = len(registers.written), registers.selects
        for _ in range(200):
            assert await registers.clk(), f"order {order}: trap must stay high until reset"
        assert (len(registers.written), registers.selects) == (written, selects), (
            f"order {order}: no access may follow in a trap"
        )
        assert all(where in (0x0C, 0x10, 0xFFFC) for where, _ in registers.written), (
            f"order {order}: nothing was written elsewhere"
        )
        registers.words[8] = 0
        registers.written.clear()
        assert not await registers.clk(rst=1)
        await registers.until(lambda: len(registers.taken(0xFFFC)) >= 20)
        starts += 1
        assert registers.taken(0x10) == [starts], "the memory keeps what it holds through a reset"


@cocotb.test()
async def an_operation_takes_3_cycles_a_product_6_a_quotient_38_and_a_register_access_8(dut):
    needs(not int(dut.CODE_BYTES.value), "the program is in the memory")
    registers = await begin(dut)
    registers.words[0], registers.words[4] = 0x12345678, 0x9ABC
    times = []
    for n in range(700):
        before = len(registers.taken(0xFFFC))
        await registers.clk()
        times += [n] * (len(registers.taken(0xFFFC)) - before)
    took = [b - a - 8 for a, b in zip(times, times[1:])]  # an operation and a write to RESULT
    dut._log.info(f"cycles for sub … remu: {took[:17]}")
    assert took[:9] == [3] * 9 and took[9:13] == [6] * 4 and took[13:17] == [38] * 4


@cocotb.test()
async def a_register_access_is_one_strobe(dut):
    registers = await begin(dut)
    await registers.until(lambda: len(registers.taken(0xFFFC)) >= ROUND)
    strobes = []
    for _ in range(500):
        strobes.append(int(dut.select.value))
        await registers.clk()
    assert sum(strobes) > 10 and not any(a and b for a, b in zip(strobes, strobes[1:]))


@cocotb.test()
async def latency_is_2_wait_cycles_for_a_word_of_the_flash_that_is_kept_and_580_for_another_one(
    dut,
):
    rtl_only("the accesses of the core are inside")
    needs(int(dut.CODE_BYTES.value), "the program is in the flash")
    registers, waited = await begin(dut), []
    core, cycles = dut.u_core, 0
    await registers.until(lambda: registers.taken(0x10))
    for _ in range(20000):
        await registers.clk()
        if not int(core.mem_valid.value):
            continue
        if int(core.mem_ready.value) and kind(core) == "flash":
            waited.append(cycles)
        cycles = 0 if int(core.mem_ready.value) else cycles + 1
    assert set(waited) == {2, 580} and waited.count(2) > 10 * waited.count(580) > 100


def kind(core):
    """Of the access that the core makes."""
    if int(core.mem_addr.value) >> 28 == firmware_build.CODE_AT >> 28:
        return "flash"
    if int(core.mem_addr.value) >= BYTES:
        return "register"
    if int(core.mem_wstrb.value):
        return "write"
    return "instruction" if int(core.mem_instr.value) else "read"


@cocotb.test()
async def latency_is_0_to_3_wait_cycles(dut):
    """`mem_ready` comes in the first cycle of an access, or one, two or three cycles later."""
    rtl_only("the accesses of the core are inside")
    needs(not int(dut.CODE_BYTES.value), "the program is in the memory")
    registers, waited = await begin(dut), {}
    core, cycles = dut.u_core, 0
    for _ in range(3000):
        await registers.clk()
        if not int(core.mem_valid.value):
            continue
        if int(core.mem_ready.value):
            waited.setdefault(kind(core), []).append(cycles)
        cycles = 0 if int(core.mem_ready.value) else cycles + 1
    instructions = waited.pop("instruction")
    assert {name: set(cycles) for name, cycles in waited.items()} == {
        "write": {0},
        "read": {1},
        "register": {3},
    }
    assert set(instructions) == {0, 1, 2}
    share = instructions.count(0) / len(instructions)
    assert share > 0.7, f"only {share:.0%} of the instructions were read ahead"


@cocotb.test()
async def every_word_that_the_core_takes_is_the_one_in_the_memory(dut):
    """Also what the proof assumes: no access begins before the last one is done, the core keeps it
    until then, and the operand was the address of a word of data one cycle before.
    """
    rtl_only("the accesses of the core are inside")
    registers = await begin(dut)
    core, taken, kept, operand = dut.u_core, set(), None, 0
    most = 12000 + LONGEST[registers.code] - LONGEST[0]
    for n in range(most):
        registers.words[8] = 0 if n < most - 2000 else TRAPS[3]  # the last part ends in a trap
        await registers.clk()
        valid, ready = int(core.mem_valid.value), int(core.mem_ready.value)
        if int(core.mem_la_read.value) or int(core.mem_la_write.value):
            assert ready or not valid
        access = [int(x.value) for x in (core.mem_addr, core.mem_instr, core.mem_wstrb)]
        access.append(str(core.mem_wdata.value))  # it has no value before the first write
        assert kept is None or (valid and access == kept)
        if valid and kept is None and kind(core) == "read":
            assert access[0] // 4 == operand // 4
        kept = access if valid and not ready else None
        operand = int(core.pcpi_rs1.value) if core.pcpi_rs1.value.is_resolvable else 0
        word = int(core.mem_addr.value) // 4
        if valid and ready and kind(core) in ("instruction", "read"):
            assert int(core.mem_rdata.value) == int(dut.u_memory.memory[word].value), f"cycle {n}"
            taken.add(word)
        if valid and ready and kind(core) == "flash":
            at = 4 * word - firmware_build.CODE_AT + CODE_START
            code = registers.flash.memory[at : at + 4]
            assert int(core.mem_rdata.value) == int.from_bytes(code, "little"), f"cycle {n}"
            taken.add(word)
    assert len(taken) > 200


@cocotb.test()
async def a_register_access_waits_until_the_registers_are_ready(dut):
    needs(not int(dut.CODE_BYTES.value), "the program is in the memory")
    registers = await begin(dut)
    await registers.until(lambda: registers.taken(0x10))
    dut.ready.value = 0
    for _ in range(2):
        await registers.clk()
    selects = registers.selects
    for _ in range(100):
        await registers.clk()
    assert registers.selects == selects
    dut.ready.value = 1
    await registers.clk()
    await registers.clk()  # select follows ready by one cycle
    assert registers.selects == selects + 1, "the access that waited is the next one"
    await registers.until(lambda: len(registers.taken(0xFFFC)) >= ROUND)
    assert not int(dut.trap.value)


@pytest.mark.parametrize("code", [0, CODE])
def test_soft_core(code):
    words = ROOT / "build" / "soft_core" / f"program_{code}.hex"
    content, in_flash = core_program.content("soft", BYTES, BYTES, code)
    words.write_text("".join(f"{word:08x}\n" for (word,) in struct.iter_unpack("<I", content)))
    if code:
        FLASH.write_bytes(in_flash)
    parameters = {"CODE_BYTES": code, "CODE_START": CODE_START}
    run("soft_core", __file__, MEMORY_BYTES=BYTES, FIRMWARE=str(words), **parameters)

# SPDX-License-Identifier: Apache-2.0
"""serial_core: a compiled program comes out of a flash, executes every instruction and access width
on operands from the register bus, then makes every wrong access. Its results must be those of
tb/cpu/serial_core.py. Through the port of the flash it sends bytes and starts other images.
"""

import random

import cocotb
import pytest

from tb.bench import ROOT, needs, on_netlist, rtl_only, run, start
from tb.cpu import core_program
from tb.cpu.serial_core import results
from tb.cpu.test_flash_loader import Flash

BYTES = 4096  # of the memory
PROGRAM = 2048  # bytes that are copied
START = 131072
FLASH = ROOT / "build" / "serial_core" / "program.bin"
TRAPS = range(1, 9)  # ORDER in serial_test.c
PORT_ORDERS = (16, 17)  # that use the port of the flash
BOOT = 64 * (64 + PROGRAM // 4 + 2)  # cycles until the core starts


class Registers(core_program.Registers):
    """With the flash."""

    def __init__(self, dut):
        super().__init__(dut)
        self.flash = Flash(FLASH.read_bytes() + bytes(1), START)

    async def clk(self, rst=0):
        trap, dut = await super().clk(rst), self.dut
        pins = (dut.flash_cs_n, dut.flash_sclk, dut.flash_mosi)
        dut.flash_miso.value = self.flash.step(*(int(pin.value) for pin in pins))
        return trap

    async def until(self, done, clks=30000):
        return await super().until(done, clks)


async def begin(dut, whole=False):
    """The core runs. The memory keeps the program, so in the RTL only the first start copies the
    `whole` program, the others the last word again.
    """
    await start(dut, rdata=0, ready=1, flash_miso=1)
    registers = Registers(dut)
    for _ in range(3):
        await registers.clk(rst=1)
    if not (whole or on_netlist()):
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
    await core_program.results_are_right(registers, pairs, results, 30000)
    strobes = registers.strobes
    assert not any(a and b for a, b in zip(strobes, strobes[1:])), "an access is one strobe"


@cocotb.test()
async def latency_is_1_wait_cycle_for_memory_and_3_for_a_register(dut):
    """An operation takes 36 to 38 cycles, and all others 66 to 110."""
    rtl_only("whether an access is one of memory is known inside only")
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
    assert waited == {"memory": {1}, "register": {3}}
    short, long = ({t for t in times[1:] if (t < 60) == less} for less in (True, False))
    assert short and short <= {36, 37, 38} and 66 <= min(long) and max(long) <= 110


@cocotb.test()
async def every_wrong_access_traps_and_reset_starts_the_core_again(dut):
    for order in (*TRAPS, *(() if int(dut.HAS_UPDATE.value) else PORT_ORDERS)):
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
    rtl_only("that the core waits is known inside only")
    registers = await begin(dut)
    dut.ready.value = 0
    await registers.clk()
    await registers.until(lambda: not any(registers.strobes[-300:]), 5000)
    assert int(dut.load_or_store.value)
    dut.ready.value = 1
    await registers.clk()
    await registers.until(lambda: len(registers.taken(0xFFFC)) >= 5)
    assert not int(dut.trap.value)


async def started(registers, slot):
    """A load from the flash, whose address the flash checks, ends early; the program starts."""
    registers.flash.start = START + 65536 * slot
    await registers.until(lambda: not int(registers.dut.loaded.value), 20000)
    registers.words[8] = 0
    registers.written.clear()
    await registers.until(lambda: len(registers.flash.bits) > 32, BOOT)
    registers.dut.u_loader.count.value = PROGRAM // 4 - 1
    await registers.until(lambda: registers.taken(0x10), 3000)


@cocotb.test()
async def the_port_exchanges_a_byte_with_the_flash_and_names_image_and_start(dut):
    needs(int(dut.HAS_UPDATE.value), "there is no port of the flash")
    rtl_only("whether the port rests is known inside only")
    registers = await begin(dut)
    for ends in (0, 1):
        registers.words[4], registers.words[8] = ends << 8 | 0xA5, 16
        registers.flash.out = ends
        registers.written.clear()
        await registers.until(lambda: START in registers.taken(0xFFFC), 30000)
        await registers.until(lambda: int(dut.u_loader.rests.value))
        at = registers.taken(0xFFFC).index(START)
        assert registers.taken(0xFFFC)[at - 1] == 0xFF * ends
        assert int(dut.flash_cs_n.value) == ends
        if not ends:
            assert registers.flash.bits[-8:] == [1, 0, 1, 0, 0, 1, 0, 1]
            registers.flash.bits = []


@cocotb.test()
async def another_image_starts_and_one_on_trial_is_replaced_by_image_0_in_time(dut):
    needs(int(dut.HAS_UPDATE.value), "there is no choice of an image")
    rtl_only("the count of the loader and the time of a trial are set inside")
    registers = await begin(dut)
    registers.words[4], registers.words[8] = 0b1110, 17  # image 2, on trial
    await started(registers, 2)
    assert (int(dut.slot.value), int(dut.trial.value)) == (2, 1)
    registers.words[4], registers.words[8] = 0, 17
    await registers.until(lambda: not int(dut.trial.value))
    await registers.clk()
    await registers.clk()
    assert int(dut.trial_time.value) == 0 and int(dut.slot.value) == 2, "the image is kept"
    dut.trial.value = 1
    dut.trial_time.value = 2**28 - 3
    await started(registers, 0)
    assert (int(dut.slot.value), int(dut.trial.value)) == (0, 0)


@pytest.mark.parametrize("update", [0, 1])
def test_serial_core(update):
    content = core_program.content("serial", BYTES, PROGRAM)[0]
    FLASH.write_bytes(content)
    parameters = {"MEMORY_BYTES": BYTES, "PROGRAM_BYTES": PROGRAM, "FLASH_START": START}
    run("serial_core", __file__, HAS_UPDATE=update, **parameters)

# SPDX-License-Identifier: Apache-2.0
"""relay_store with a chip: both copies, each broken, the time of a copy, bytes passed through, and
reset while it reads.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.relay.flash import Flash

LENGTH, FIRST, SECOND = 20, 4096, 8192


class Store:
    """The design with a chip on its pins, two cycles late as behind a synchroniser, and a set that
    reports good or bad.
    """

    def __init__(self, dut, first, second):
        self.dut, self.chip, self.copies, self.line = dut, Flash(1 << 14), [], [1, 1]
        self.chip.memory[FIRST : FIRST + LENGTH], self.chip.memory[SECOND : SECOND + LENGTH] = (
            first,
            second,
        )
        self.judge = lambda copy: copy[0] == 1
        self.passed = []

    async def reset(self):
        await start(self.dut, good=0, bad=0, pass_select=0, pass_valid=0, pass_data=0, sdi=1)
        await FallingEdge(self.dut.clk)
        return self

    async def clk(self, rst=0, **inputs):
        dut, verdict = self.dut, None
        if self.copies and len(self.copies[-1]) == LENGTH and dut.busy.value and self.waits == 0:
            verdict = self.judge(self.copies[-1])
            self.waits = -1
        elif self.copies and len(self.copies[-1]) == LENGTH:
            self.waits -= 1
        dut.good.value, dut.bad.value, dut.rst.value = (
            int(verdict is True),
            int(verdict is False),
            rst,
        )
        for name, level in inputs.items():
            getattr(dut, name).value = level
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.line = [
            *self.line[1:],
            self.chip.pins(int(dut.chip_n.value), int(dut.sclk.value), int(dut.sdo.value)),
        ]
        dut.sdi.value = self.line[0]
        if dut.start.value:
            self.copies.append(b"")
            self.waits = 1
        if dut.valid.value:
            self.copies[-1] += bytes([int(dut.data.value)])
        if dut.pass_done.value:
            self.passed.append(int(dut.data.value))

    async def done(self):
        """Run until the store is done; returns the cycles."""
        clks = 0
        while clks == 0 or self.dut.busy.value:
            await self.clk()
            clks += 1
            assert clks < 20_000
        return clks

    async def send(self, row):
        """Send bytes to the chip; returns its answer."""
        self.passed = []
        await self.clk(pass_select=1)
        for n, byte in enumerate(row):
            while not self.dut.pass_ready.value:
                await self.clk()
            await self.clk(pass_valid=1, pass_data=byte)
            assert not self.dut.pass_ready.value
            self.dut.pass_valid.value = 0
            while len(self.passed) <= n:
                await self.clk()
        await self.clk(pass_select=0)
        await self.clk()
        return bytes(self.passed)


def some(first_byte):
    return bytes([first_byte, *random.randbytes(LENGTH - 1)])


@cocotb.test()
async def the_first_whole_copy_is_taken(dut):
    for marks, source in (((1, 1), 1), ((0, 1), 2), ((1, 0), 1), ((0, 0), 0)):
        copies = [some(mark) for mark in marks]
        store = await Store(dut, *copies).reset()
        await store.done()
        assert int(dut.source.value) == source
        assert store.copies == (copies[:1] if marks[0] else copies)


@cocotb.test()
async def latency_is_2048_and_66_for_each_byte(dut):
    """A byte takes 66 cycles: one to begin it, 8 bits of 8 cycles, one to pass it on. Before a
    copy come a pause of 2048 cycles and the four bytes of the command and its address; before the
    first copy, also the byte that wakes the chip.
    """
    store = await Store(dut, some(0), some(1)).reset()
    cycles = []  # cycles from reset, or from the verdict, to the last byte of each copy
    for bytes_before in (5, 4):
        clks = 0
        while not (dut.valid.value and len(store.copies[-1]) == LENGTH):
            await store.clk()
            clks += 1
        cycles.append(clks)
        assert clks == 2048 + 66 * (LENGTH + bytes_before), cycles
        while not (dut.bad.value or dut.good.value):
            await store.clk()
    assert (
        store.copies == [bytes(store.chip.memory[at : at + LENGTH]) for at in (FIRST, SECOND)]
        and int(dut.source.value) == 2
    )


@cocotb.test()
async def bytes_pass_through_both_ways(dut):
    store = await Store(dut, some(1), some(1)).reset()
    await store.done()
    await store.send(b"\x06")
    await store.send(bytes([0x02, 0x00, 0x30, 0x10]) + b"moire")
    assert store.chip.memory[0x3010:0x3015] == b"moire"
    assert (await store.send(bytes([0x03, 0x00, 0x30, 0x10]) + bytes(5)))[4:] == b"moire"


@cocotb.test()
async def while_it_reads_it_is_not_ready_for_other_bytes(dut):
    store = await Store(dut, some(0), some(1)).reset()
    await store.clk(pass_select=1)
    while dut.busy.value:
        assert not dut.pass_ready.value
        await store.clk()
    await store.clk()
    await store.clk()
    assert dut.pass_ready.value and not dut.chip_n.value
    await store.clk(pass_select=0)


@cocotb.test()
async def reset_while_it_reads_starts_from_the_beginning(dut):
    copy = some(1)
    store = await Store(dut, copy, some(1)).reset()
    for wait in (100, 2300, 2700, 3200):
        for _ in range(wait):
            await store.clk()
        await store.clk(rst=1)
        store.copies = []
    await store.done()
    assert store.copies == [copy] and int(dut.source.value) == 1


def test_relay_store():
    run("relay_store", __file__, LENGTH=LENGTH, FIRST=FIRST, SECOND=SECOND)

# SPDX-License-Identifier: Apache-2.0
"""register_memory: first values, every setting of every axis, words of 64 bits, reset, and random
accesses against the model in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import run, start
from tb.registers.register_block import WORD
from tb.registers.register_layout import built_of
from tb.registers.register_memory import FILL, RegisterMemory

SEGMENT_VELOCITY = 0x4B0 // 4  # 64 bits, of axis 0
STEP_RATIO = 0x1418 // 4  # 48 bits, signed
KP = 0x480 // 4  # 24 bits
SEGMENT_ORIGIN = 0xCB8 // 4  # 48 bits, only written


class Bus:
    """One cycle at a time, the model beside the memory in every one of them."""

    def __init__(self, dut):
        self.dut = dut
        self.model = RegisterMemory(int(dut.AXES.value), built_of(dut))
        self.known = False

    async def begin(self):
        await start(self.dut, hold=0, select=0, write=0, address=0, wdata=0)
        await self.fill()
        return self

    async def fill(self):
        """The cycles until ready, right after the one in which rst was high."""
        for n in range(FILL):
            assert not int(self.dut.ready.value), f"ready after {n} cycles"
            await self.clk()
        assert int(self.dut.ready.value)

    async def clk(self, select=0, write=0, address=0, wdata=0, rst=0, hold=0):
        dut, model = self.dut, self.model
        inputs = dict(select=select, write=write, address=address, wdata=wdata, rst=rst, hold=hold)
        for name, level in inputs.items():
            getattr(dut, name).value = level
        await Timer(1, "ns")
        if not rst:
            want = model.stores(**inputs)
            assert int(dut.stores.value) == int(want is not None)
            assert not want or (int(dut.stored_at.value), int(dut.stored_value.value)) == want
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        model.step(**inputs)
        assert int(dut.ready.value) == model.ready
        self.known |= bool(select and not write)
        if self.known:
            assert int(dut.rdata.value) == model.rdata, f"word {address:#x}"

    async def access(self, write, address, wdata=0, rst=0):
        """The cycle in which address and wdata come, and the access."""
        await self.clk(0, random.getrandbits(1), address, wdata)
        await self.clk(1, write, address, wdata, rst)

    async def read(self, address):
        await self.access(0, address)
        return int(self.dut.rdata.value)

    async def write(self, address, wdata):
        await self.access(1, address, wdata)
        if self.model.layout.low(address):
            assert int(self.dut.wdata_low.value) == wdata

    async def write_wide(self, address, value):
        await self.write(address, value & WORD)
        await self.write(address + 1, value >> 32)


@cocotb.test()
async def latency_is_2048_from_the_end_of_rst_to_ready(dut):
    bus = await Bus(dut).begin()  # it counts the cycles
    await bus.clk(rst=1)
    await bus.fill()


@cocotb.test()
async def hold_delays_the_first_values_and_each_is_shown_once(dut):
    bus = await Bus(dut).begin()
    await bus.clk(rst=1)
    shown = []
    while not bus.model.ready:
        hold = int(random.random() < 0.3)
        if not hold:
            shown.append(bus.model.count)
        await bus.clk(hold=hold)
    assert shown == list(range(FILL))
    assert await bus.read(KP) == 0


@cocotb.test()
async def latency_is_1_from_an_access_to_rdata_and_wdata_low(dut):
    bus = await Bus(dut).begin()
    await bus.write(KP, 0x12_3456)
    assert await bus.read(KP) == 0x12_3456
    await bus.access(1, STEP_RATIO, 0x89AB_CDEF)
    assert int(dut.wdata_low.value) == 0x89AB_CDEF


@cocotb.test()
async def reset_gives_every_word_its_first_value(dut):
    bus = await Bus(dut).begin()
    layout = bus.model.layout
    words = [*layout.entries, 0x300 // 4, 0x3FFF]
    for address in words:
        assert await bus.read(address) == layout.first(address)
    for address in words:
        await bus.write(address, WORD)
    await bus.clk(rst=1)
    await bus.fill()
    for address in words:
        assert await bus.read(address) == layout.first(address)


@cocotb.test()
async def each_word_keeps_its_own_bits(dut):
    bus = await Bus(dut).begin()
    layout = bus.model.layout
    words = [a for a in layout.entries if not layout.low(a) and not layout.high(a)]
    data = {address: random.getrandbits(32) for address in words}
    for address in words:
        await bus.write(address, data[address])
    for address in words:
        assert await bus.read(address) == layout.stored_bits(address, data[address])


@cocotb.test()
async def a_wide_setting_changes_with_its_high_word(dut):
    bus = await Bus(dut).begin()
    old, new = 0x1111_2222_3333_4444, 0xAAAA_BBBB_CCCC_DDDD
    await bus.write_wide(SEGMENT_VELOCITY, old)
    await bus.write(SEGMENT_VELOCITY, new & WORD)
    await bus.write(KP, 5)  # another register between the two words
    assert await bus.read(SEGMENT_VELOCITY) == old & WORD, "the low word waits"
    await bus.write(SEGMENT_VELOCITY + 1, new >> 32)
    assert await bus.read(SEGMENT_VELOCITY) == new & WORD
    assert await bus.read(SEGMENT_VELOCITY + 1) == new >> 32
    await bus.write_wide(STEP_RATIO, new)
    assert await bus.read(STEP_RATIO) == new & WORD
    assert await bus.read(STEP_RATIO + 1) == 0xFFFF_BBBB, "sign-extended from 48 bits"
    await bus.write_wide(SEGMENT_ORIGIN, new)
    assert [await bus.read(SEGMENT_ORIGIN + n) for n in (0, 1)] == [0, 0], "only written"


@cocotb.test()
async def an_address_without_a_block_reads_0_and_changes_nothing(dut):
    bus = await Bus(dut).begin()
    axes = bus.model.layout.slots
    for address in (0x300 // 4, 0x3FFF, *(b << 6 for b in range(256) if b not in axes)):
        await bus.write(address, WORD)
        assert await bus.read(address) == 0
    for address in bus.model.layout.entries:
        assert await bus.read(address) == bus.model.layout.first(address)


@cocotb.test()
async def any_access_every_2_cycles_matches_the_model(dut):
    bus = await Bus(dut).begin()
    words = [*bus.model.layout.entries]
    for _ in range(4000):
        address = random.choice(words) if random.random() < 0.9 else random.getrandbits(14)
        if random.getrandbits(1):
            await bus.write(address, random.getrandbits(32))
        else:
            await bus.read(address)


@cocotb.test()
async def a_reset_between_the_two_words_leaves_first_values(dut):
    bus = await Bus(dut).begin()
    await bus.write_wide(SEGMENT_VELOCITY, 7 << 32 | 8)
    await bus.write(SEGMENT_VELOCITY, 9)
    await bus.access(1, SEGMENT_VELOCITY + 1, 10, rst=1)
    await bus.fill()
    assert [await bus.read(SEGMENT_VELOCITY + n) for n in (0, 1)] == [0, 0]


@pytest.mark.parametrize("axes, masks", [(1, {}), (3, dict(HAS_SINE=0b101)), (8, dict(HAS_DAC=0))])
def test_register_memory(axes, masks):
    run("register_memory", __file__, AXES=axes, **masks)

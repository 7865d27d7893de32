# SPDX-License-Identifier: Apache-2.0
"""flash_loader: each pin and each stored word against the model in every cycle, with a flash behind
it that sleeps until it is woken, and with random levels; reset in the middle; then single bytes of
the firmware.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.cpu.flash_loader import FlashLoader

WORDS, START, PAUSE = 8, 0x12345, 3


class Flash:
    """Its output after each cycle, from the levels of its pins."""

    def __init__(self, content, start=START):
        self.content, self.start, self.awake = content, start, False
        self.bits, self.sclk, self.out = [], 0, 1

    def step(self, cs_n, sclk, mosi):
        if cs_n:
            self.awake |= self.bits[:8] == [1, 0, 1, 0, 1, 0, 1, 1]
            self.bits = []
        elif sclk and not self.sclk:
            self.bits.append(mosi)
        elif self.sclk and not sclk and len(self.bits) >= 32 and self.awake:
            head = sum(bit << 31 - n for n, bit in enumerate(self.bits[:32]))
            assert head == 0x03 << 24 | self.start, f"command {head:#010x}"
            at, bit = divmod(len(self.bits) - 32, 8)
            self.out = self.content[at] >> 7 - bit & 1
        self.sclk = sclk
        return self.out


class Bench:
    def __init__(self, dut, slot=0):
        self.dut, self.slot, self.words = dut, slot, {}
        self.model = FlashLoader(WORDS, START, PAUSE, slot)

    async def begin(self):
        await start(self.dut, miso=1, slot=self.slot, send=0, data=0, ends=0)
        await self.clk(1, rst=1)
        return self

    async def clk(self, miso, rst=0, send=None):
        """One cycle; returns the levels of cs_n, sclk and mosi in it."""
        dut = self.dut
        dut.miso.value, dut.rst.value, dut.send.value = miso, rst, int(send is not None)
        if send:
            dut.data.value, dut.ends.value = send
        await RisingEdge(dut.clk)
        self.model.step(miso, rst, send)
        await FallingEdge(dut.clk)
        cs_n, sclk, done, mosi = self.model.pins()
        got = tuple(int(port.value) for port in (dut.cs_n, dut.sclk, dut.done))
        assert got == (cs_n, sclk, done), f"cycle {self.model.cycle}"
        assert mosi is None or int(dut.mosi.value) == mosi, f"cycle {self.model.cycle}"
        stored = self.model.stored(miso)
        assert int(dut.store.value) == (stored is not None), f"cycle {self.model.cycle}"
        if stored:
            assert (int(dut.address.value), int(dut.word.value)) == stored
            self.words[stored[0]] = stored[1]
        return cs_n, sclk, int(dut.mosi.value)


@cocotb.test()
async def it_wakes_the_flash_and_copies_all_words_in_their_order(dut):
    bench = await Bench(dut).begin()
    content = [random.getrandbits(8) for _ in range(4 * WORDS + 1)]
    flash, miso, cycles = Flash(content), 1, 0
    while not bench.model.done:
        miso = flash.step(*await bench.clk(miso))
        cycles += 1
        assert cycles < 10000
    want = [int.from_bytes(bytes(content[k : k + 4]), "little") for k in range(0, 4 * WORDS, 4)]
    assert [bench.words[n] for n in range(WORDS)] == want
    for _ in range(200):
        await bench.clk(miso)


@cocotb.test()
async def latency_is_64_cycles_for_each_period_and_done_stays(dut):
    bench = await Bench(dut).begin()
    cycles = 0
    while not int(dut.done.value):
        await bench.clk(random.getrandbits(1))
        cycles += 1
    assert cycles == 64 * (PAUSE + WORDS + 2)


@cocotb.test()
async def a_reset_in_the_middle_begins_again(dut):
    bench = await Bench(dut).begin()
    for cycles in (10, 64, 64 * PAUSE + 100, 64 * (PAUSE + 4) + 33):
        for _ in range(cycles):
            await bench.clk(random.getrandbits(1))
        await bench.clk(0, rst=1)
    for _ in range(64 * (PAUSE + WORDS + 3)):
        await bench.clk(random.getrandbits(1))
    assert int(dut.done.value)


@cocotb.test()
async def each_slot_is_copied_from_64_kib_behind_the_last_one(dut):
    for slot in (1, 3):
        bench = await Bench(dut, slot).begin()
        content = [random.getrandbits(8) for _ in range(4 * WORDS + 1)]
        flash, miso = Flash(content, START + 65536 * slot), 1
        while not bench.model.done:
            miso = flash.step(*await bench.clk(miso))
        assert bench.words[0] == int.from_bytes(bytes(content[:4]), "little")


@cocotb.test()
async def latency_is_16_cycles_for_a_byte_of_the_firmware_which_is_ignored_before_done(dut):
    bench = await Bench(dut).begin()
    while not bench.model.done:
        await bench.clk(random.getrandbits(1), send=(random.getrandbits(8), 1))
    for n in range(40):
        data, ends = random.choice([0, 255, random.getrandbits(8)]), int(n % 5 == 4)
        await bench.clk(random.getrandbits(1), send=(data, ends))
        for _ in range(16 + random.choice([0, 0, 1, 30])):
            await bench.clk(random.getrandbits(1))
        assert int(dut.answer.value) == bench.model.answer(), f"byte {n}"
        assert int(dut.cs_n.value) == ends
    await bench.clk(0, send=(0xA5, 0))
    await bench.clk(0, rst=1)
    assert not int(dut.done.value), "a reset copies again"


def test_flash_loader():
    run("flash_loader", __file__, WORDS=WORDS, START=START, PAUSE=PAUSE)

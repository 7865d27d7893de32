# SPDX-License-Identifier: Apache-2.0
"""spi_word_sender: a word by hand, its times, the device's view of the wires, reset in mid-word,
and random words against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb import bench
from tb.peripheral.spi_word_sender import SpiWordSender


class Wires:
    """The design and its model, and the words that a display driver on the wires takes."""

    def __init__(self, dut):
        self.dut, self.model, self.half_period = dut, SpiWordSender(), 1
        self.bits, self.taken, self.last, self.now = [], [], (1, 0), 0
        self.fell = self.rose = self.risen = (
            None  # cycles of the last edges of cs_n and of the last rise of sclk
        )

    async def begin(self):
        await bench.start(self.dut, half_period=1, valid=0, word=0)
        await self.clk(rst=1)
        return self

    async def clk(self, word=None, rst=0):
        d = self.dut
        d.half_period.value, d.valid.value, d.word.value, d.rst.value = (
            self.half_period,
            word is not None,
            word or 0,
            rst,
        )
        await FallingEdge(d.clk)
        want = self.model.step(word is not None, word or 0, self.half_period, rst)
        got = tuple(int(p.value) for p in (d.ready, d.cs_n, d.sclk, d.sdi, d.sent))
        assert got == want, f"{got} where the model has {want}"
        self.watch(*got[1:], rst)
        return got

    def watch(self, cs_n, sclk, sdi, sent, rst):
        self.now += 1
        before, self.last = self.last, (cs_n, sclk)
        if before[0] and not cs_n:
            self.fell, self.bits = self.now, []
        if sclk and not before[1]:
            self.bits, self.risen = [*self.bits, sdi], self.now
        rises = cs_n and not before[0]
        assert sent == (rises and len(self.bits) == 16 and not rst)
        if rises:
            self.rose = self.now
            self.taken.append(
                sum(b << 15 - n for n, b in enumerate(self.bits)) if len(self.bits) == 16 else None
            )

    async def send(self, word):
        await self.clk(word)
        while not (await self.clk())[0]:
            pass


@cocotb.test()
async def one_word_by_hand(dut):
    wires = await Wires(dut).begin()
    await wires.send(0x0C01)  # MAX7219: out of shutdown
    assert wires.bits == [0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1] and wires.taken == [
        0x0C01
    ]


@cocotb.test()
async def latency_is_33_half_periods_and_1_and_the_next_word_begins_after_36_and_1(dut):
    wires = await Wires(dut).begin()
    for half_period in (0, 1, 2, 3, 0x55, 0xAA, 255):
        wires.half_period, half = half_period, max(half_period, 1)
        await wires.clk(0xFFFF)
        wires.half_period = 7  # taken with a word
        fell = wires.fell
        assert fell == wires.now
        while not (await wires.clk(0x8001))[0]:
            pass
        assert wires.rose - fell == 33 * half and wires.risen - fell == 31 * half
        await wires.clk(0x8001)
        assert wires.fell - fell == 36 * half + 1
        while not (await wires.clk())[0]:
            pass


@cocotb.test()
async def any_words_at_any_pauses_arrive_in_order(dut):
    wires = await Wires(dut).begin()
    words = [0, 0xFFFF, *(random.getrandbits(16) for _ in range(30))]
    for word in words:
        wires.half_period = random.randrange(4)
        await wires.send(word)
        for _ in range(random.choice([0, 0, 1, 50])):
            await wires.clk()
    assert wires.taken == words


@cocotb.test()
async def reset_in_mid_word_frees_the_wires(dut):
    wires = await Wires(dut).begin()
    await wires.clk(0xFFFF)
    for _ in range(5):
        await wires.clk()
    assert (await wires.clk(rst=1))[1:] == (1, 0, 0, 0)
    await wires.send(0x1234)
    assert wires.taken == [None, 0x1234]


@cocotb.test()
async def a_reset_in_any_cycle_of_a_word_and_another_half_period_after_it_match_the_model(dut):
    wires = await Wires(dut).begin()
    for cycles in range(36 * 2 + 3):
        wires.half_period = 2
        await wires.clk(random.getrandbits(16))
        for _ in range(cycles):
            await wires.clk()
        wires.half_period = random.randrange(256)
        await wires.clk(random.getrandbits(16), rst=1)  # not taken
        wires.half_period, word = random.randrange(4), random.getrandbits(16)
        await wires.send(word)
        assert wires.taken[-1] == word


def test_spi_word_sender():
    bench.run("spi_word_sender", __file__)

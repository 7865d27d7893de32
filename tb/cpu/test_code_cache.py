# SPDX-License-Identifier: Apache-2.0
"""code_cache: ready, word and each pin against the model in every cycle, with a flash behind it
that sleeps until it is woken; every word is that of the flash, however the lines replace each
other; reset in the middle of all.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.cpu.code_cache import LINE_WORDS, CodeCache
from tb.relay.flash import Flash

BYTES, START, LINES, PAUSE = 1024, 0x12400, 4, 2
WORDS = BYTES // 4
MISS = 64 * (1 + LINE_WORDS) + 3  # cycles from request to ready


class Bench:
    def __init__(self, dut):
        self.dut, self.flash, self.miso = dut, Flash(), 1
        self.model = CodeCache(START, LINES, PAUSE)
        self.flash.memory[START : START + BYTES] = random.randbytes(BYTES)

    async def begin(self):
        await start(self.dut, miso=1, request=0, address=0)
        await self.clk(rst=1)
        return self

    def content(self, address):
        """The word of the flash."""
        at = START + 4 * address
        return int.from_bytes(self.flash.memory[at : at + 4], "little")

    async def clk(self, request=0, address=0, rst=0):
        """One cycle; whether the word is there after it."""
        dut = self.dut
        dut.request.value, dut.rst.value, dut.miso.value = request, rst, self.miso
        dut.address.value = address
        await RisingEdge(dut.clk)
        self.model.step(request, address, self.miso, rst)
        await FallingEdge(dut.clk)
        cs_n, sclk, mosi = self.model.pins()
        assert (int(dut.cs_n.value), int(dut.sclk.value)) == (cs_n, sclk)
        assert mosi is None or int(dut.mosi.value) == mosi
        assert int(dut.ready.value) == self.model.ready
        if self.model.ready:
            assert int(dut.word.value) == self.model.word == self.content(address)
        self.miso = self.flash.pins(cs_n, sclk, int(dut.mosi.value))
        return bool(self.model.ready)

    async def fetch(self, address):
        """The cycles until the word is there; it is taken in the next one."""
        cycles = 1
        while not await self.clk(1, address):
            cycles += 1
        await self.clk(1, address)  # the core takes it, and asks no more
        return cycles


async def awake(dut):
    bench = await Bench(dut).begin()
    for _ in range(64 * (PAUSE + 1)):
        await bench.clk()
    return bench


@cocotb.test()
async def latency_is_1_cycle_for_a_word_that_is_kept_and_579_for_another_one(dut):
    bench = await awake(dut)
    assert await bench.fetch(17) == MISS == 579
    for address in (17, 16, 23, 17):
        assert await bench.fetch(address) == 1
    assert await bench.fetch(15) == MISS
    assert await bench.fetch(16) == 1


@cocotb.test()
async def the_first_line_waits_until_the_flash_is_awake(dut):
    bench = await Bench(dut).begin()
    assert await bench.fetch(0) == 64 * (PAUSE + 1) + MISS
    assert not bench.flash.asleep


@cocotb.test()
async def a_word_every_2_cycles(dut):
    bench = await awake(dut)
    await bench.fetch(40)
    ready = [await bench.clk(1, 40 + n // 2 % LINE_WORDS) for n in range(64)]
    assert ready == [True, False] * 32


@cocotb.test()
async def every_word_is_that_of_the_flash_however_the_lines_replace_each_other(dut):
    bench, took = await awake(dut), []
    address = 0
    for _ in range(250):
        leaps = [address + 1, address + LINE_WORDS * LINES, random.randrange(WORDS), address]
        address = random.choices(leaps, [8, 1, 1, 2])[0] % WORDS
        took.append(await bench.fetch(address))
        for _ in range(random.choice([0, 0, 1, 5])):
            await bench.clk(0, random.randrange(WORDS))
    assert set(took) == {1, MISS} and took.count(1) > took.count(MISS) > 10


@cocotb.test()
async def a_line_replaces_the_one_that_is_as_many_lines_away(dut):
    bench = await awake(dut)
    near, far = 3 * LINE_WORDS, (3 + LINES) * LINE_WORDS
    assert [await bench.fetch(x) for x in (near, far, near, near, far)] == [
        *[MISS, MISS, MISS, 1, MISS]
    ]


@cocotb.test()
async def a_reset_in_the_middle_forgets_all_lines(dut):
    bench = await awake(dut)
    for cycles in (1, 2, 40, 64 + 300, MISS + 1):
        await bench.fetch(8)
        for _ in range(cycles):
            await bench.clk(1, 72)
        bench.flash.memory[START : START + BYTES] = random.randbytes(BYTES)
        await bench.clk(rst=1)
        assert await bench.fetch(8) == 64 * (PAUSE + 1) + MISS


@cocotb.test()
async def nothing_moves_without_a_request(dut):
    bench = await awake(dut)
    await bench.fetch(5)
    await bench.clk()
    mosi = int(dut.mosi.value)
    for _ in range(300):
        assert not await bench.clk(0, random.randrange(WORDS))
        assert (int(dut.cs_n.value), int(dut.mosi.value)) == (1, mosi)


def test_code_cache():
    run("code_cache", __file__, BYTES=BYTES, START=START, LINES=LINES, PAUSE=PAUSE)

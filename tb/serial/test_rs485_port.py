# SPDX-License-Identifier: Apache-2.0
"""rs485_port: a frame in and a reply out through the register block, when the driver is on, the
transmit time-out, and the counters.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from moire.made.registers import FIELDS
from tb.bench import run, start
from tb.serial.frame_check import frame
from tb.serial.uart_rx import character

CLK_HZ = 1_000_000
BIT = 8  # cycles of a bit
ADDRESS = 5
TIMEOUT_BITS = 1024
REGISTERS = {}
for field in FIELDS:
    if field.block == "bus":
        REGISTERS.setdefault(field.register, {})[field.field] = field


class Bus:
    """The register bus and the RS-485 bus of the design."""

    def __init__(self, dut):
        self.dut, self.trace = dut, []  # (driver_enable, tx) after each cycle

    async def begin(self):
        await start(
            self.dut, address=ADDRESS, select=0, write=0, word=0, wdata=0, armed=0, rs485_rx=1
        )
        await self.clk()
        await self.clk()
        await self.write("bit_time", 16 * BIT)
        return self

    async def clk(self, rx=1):
        self.dut.rs485_rx.value = rx
        await FallingEdge(self.dut.clk)
        self.trace.append((int(self.dut.rs485_driver_enable.value), int(self.dut.rs485_tx.value)))

    async def access(self, write, register, value=0):
        d = self.dut
        d.select.value, d.write.value, d.wdata.value = 1, write, value
        d.word.value = next(iter(REGISTERS[register].values())).offset // 4
        await self.clk()
        d.select.value = 0
        return str(d.rdata.value)

    async def write(self, register, value):
        await self.access(1, register, value)

    async def read(self, register):
        word = (await self.access(0, register)).replace(
            "X", "0"
        )  # the bits of an empty queue are unknown
        got = {
            name: int(word, 2) >> f.low & (1 << f.width) - 1
            for name, f in REGISTERS[register].items()
        }
        return got["value"] if list(got) == ["value"] else got

    async def levels(self, levels):
        for level in levels:
            for _ in range(BIT):
                await self.clk(level)

    async def words(self, words, gap=0):
        for data, ninth in words:
            await self.levels([*character(data, ninth), *[1] * gap])

    async def taken(self):
        """The words in the receive queue as (data, ninth bit, good)."""
        words = []
        while (word := await self.read("receive"))["present"]:
            words.append((word["data"], word["command"], word["good"]))
            await self.clk()  # the next word comes to the output
        return words

    async def until_silent(self):
        while not int(self.dut.rs485_driver_enable.value):
            await self.clk()
        while int(self.dut.rs485_driver_enable.value):
            await self.clk()


@cocotb.test()
async def the_last_word_of_a_received_frame_is_flagged_good(dut):
    bus = await Bus(dut).begin()
    words = frame(0x20 | ADDRESS, b"\x01\x02\x03")
    await bus.words(words)
    await bus.levels([1] * 4)
    assert await bus.taken() == [
        (data, ninth, int(n == len(words) - 1)) for n, (data, ninth) in enumerate(words)
    ]
    assert await bus.read("frames_good") == 1 and await bus.read("frames_bad") == 0


@cocotb.test()
async def the_driver_is_on_a_bit_before_the_start_bit_and_half_a_bit_after_the_stop_bit(dut):
    bus = await Bus(dut).begin()
    bus.trace.clear()
    for data in (0xA5, 0x00, 0xFF):
        await bus.write("transmit", data)
    await bus.until_silent()
    on, off = bus.trace.index((1, 1)), len(bus.trace) - 1
    first = bus.trace.index((1, 0))
    assert first - on >= BIT and all(tx for _, tx in bus.trace[:first])
    assert off - (first + 3 * 11 * BIT) >= BIT // 2
    sent = [bus.trace[first + BIT // 2 + BIT * n][1] for n in range(33)]
    assert sent == [*character(0xA5, 0), *character(0x00, 0), *character(0xFF, 0)]


@cocotb.test()
async def a_node_does_not_receive_what_it_sends(dut):
    bus = await Bus(dut).begin()
    await bus.write("transmit", 0x120 | ADDRESS)
    while not int(dut.rs485_driver_enable.value):
        await bus.clk()
    while int(dut.rs485_driver_enable.value):
        await bus.clk(int(dut.rs485_tx.value))
    await bus.levels([1] * 12)
    assert await bus.taken() == []
    assert await bus.read("framing_errors") == 0 and await bus.read("start_glitches") == 0


@cocotb.test()
async def a_node_that_sends_for_too_long_is_cut_off_and_counted_and_may_send_again_later(dut):
    bus = await Bus(dut).begin()
    for _ in range(120):  # 1320 bits
        await bus.write("transmit", 0x00)
    bus.trace.clear()
    await bus.levels([1] * 1500)
    driven = [cycle for cycle, (on, _) in enumerate(bus.trace) if on]
    assert TIMEOUT_BITS * BIT - 200 < len(driven) <= TIMEOUT_BITS * BIT and all(
        tx for on, tx in bus.trace if not on
    )
    assert await bus.read("transmit_timeouts") == 1
    bus.trace.clear()
    await bus.write("transmit", 0x55)
    await bus.until_silent()
    assert sum(on for on, _ in bus.trace) > 11 * BIT and await bus.read("transmit_timeouts") == 1


@cocotb.test()
async def the_longest_reply_is_not_cut_off(dut):
    bus = await Bus(dut).begin()
    for _ in range(70):  # ready byte, length, 64 bytes, CRC-32
        await bus.write("transmit", 0x00)
    await bus.until_silent()
    assert await bus.read("transmit_timeouts") == 0


@cocotb.test()
async def a_break_is_counted_and_the_next_frame_is_good(dut):
    bus = await Bus(dut).begin()
    await bus.words(frame(0x20 | ADDRESS, b"\x01")[:4])
    for _ in range(2 * CLK_HZ // 1000 + 10):
        await bus.clk(0)
    await bus.levels([1] * 12)
    assert (
        await bus.read("breaks") == 1
        and await bus.read("framing_errors") == 1
        and await bus.read("frames_bad") == 1
    )
    await bus.words(frame(0x20 | ADDRESS, b"\x02"))
    await bus.levels([1] * 8)
    assert await bus.read("frames_good") == 1


@cocotb.test()
async def a_glitch_is_no_start_bit_and_a_lost_stop_bit_ends_the_frame(dut):
    bus = await Bus(dut).begin()
    for _ in range(2):  # of one cycle only, it may be lost on its way into the clock domain
        await bus.clk(0)
    await bus.levels([1] * 12)
    assert await bus.read("start_glitches") == 1
    words = frame(0x20 | ADDRESS, b"\x07")
    for n, (data, ninth) in enumerate(words):
        await bus.levels(character(data, ninth, stop=int(n != 3)))
        await bus.levels([1] * 2)
    assert await bus.read("frames_good") == 0 and await bus.read("framing_errors") == 1


@cocotb.test()
async def a_frame_for_all_nodes_is_a_sync_in_the_middle_of_its_last_stop_bit(dut):
    bus = await Bus(dut).begin()
    await bus.write("sync_axes", 0x5)
    assert int(dut.sync_axes.value) == 5
    words, at = frame(0x20, b"\x07"), []
    levels = [level for data, ninth in words for level in character(data, ninth)]
    for n, level in enumerate(levels + [1] * 12):
        for part in range(BIT):
            await bus.clk(level)
            at += [n * BIT + part] * int(dut.sync.value)
    assert len(at) == 1 and 0 <= at[0] - (len(levels) * BIT - BIT // 2) <= 14
    assert await bus.read("syncs") == 1 and await bus.read("frames_good") == 1
    await bus.words(frame(0x20 | ADDRESS, b"\x08"))
    await bus.levels([1] * 8)
    assert await bus.read("syncs") == 1 and await bus.read("frames_good") == 2


@cocotb.test()
async def random_frames_are_good_when_they_are_whole_and_for_this_node(dut):
    bus, good = await Bus(dut).begin(), 0
    for _ in range(40):
        address, body = random.choice([ADDRESS, ADDRESS, 3]), random.randbytes(random.randint(1, 6))
        words = frame(0x20 | address, body)
        if broken := random.random() < 0.3:
            words[random.randrange(1, len(words))] = (random.getrandbits(8), random.getrandbits(1))
        whole = words == frame(0x20 | address, body)
        assert whole or broken
        await bus.words(words, gap=random.choice([0, 0, 3]))
        await bus.levels([1] * 8)
        good += whole and address == ADDRESS
    assert await bus.read("frames_good") == good > 10
    await bus.taken()


def test_rs485_port():
    run("rs485_port", __file__, CLK_HZ=CLK_HZ)

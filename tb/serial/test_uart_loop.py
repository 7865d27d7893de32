# SPDX-License-Identifier: Apache-2.0
"""uart_tx and uart_rx without the 9th bit (8N1), with eight and with four ticks of a bit: one
character by hand, every byte, sigrok, and noise against both models.
"""

import random
from fractions import Fraction

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import needs, run, start
from tb.serial.uart_rx import UartRx, character, line
from tb.serial.uart_tx import UartTx
from tools import sigrok


class Loop:
    """Both designs with their models beside them in every cycle."""

    def __init__(self, dut):
        self.dut, self.parts = dut, int(dut.PARTS.value)
        self.sender, self.receiver = UartTx(0, self.parts), UartRx(0, self.parts)
        self.received, self.wave, self.errors = [], bytearray(), 0

    async def begin(self):
        await start(self.dut, bit_time=128, valid=0, data=0, rx=1)
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        return self

    async def clk(self, bit_time, data=None, rx=None):
        """Advance one cycle; with rx None the receiver listens to the transmitter. Return whether
        the byte was taken.
        """
        d, taken = self.dut, data is not None and self.sender.ready(bit_time)
        rx = int(d.tx.value) if rx is None else rx
        d.bit_time.value, d.valid.value, d.data.value, d.rx.value = (
            bit_time,
            data is not None,
            data or 0,
            rx,
        )
        await FallingEdge(d.clk)
        got = int(d.ready.value), int(d.tx.value), int(d.driver_enable.value)
        assert got == self.sender.step(data is not None, data or 0, 0, bit_time)
        valid, byte, ninth, *flags = self.receiver.step(rx, bit_time)
        assert [int(p.value) for p in (d.received, d.framing_error, d.start_glitch, d.busy)] == [
            valid,
            *flags,
        ]
        if valid:
            assert (int(d.character.value), int(d.ninth.value)) == (byte, ninth) == (byte, 0)
            self.received.append(byte)
        self.errors += flags[0]
        self.wave.append(got[1])
        return taken

    async def send(self, data, bit_time, gaps=False):
        for byte in data:
            while not await self.clk(bit_time, byte):
                pass
            for _ in range(random.choice([0, 0, 300]) if gaps else 0):
                await self.clk(bit_time)
        for _ in range(12 * bit_time // 16 + 4):
            await self.clk(bit_time)


@cocotb.test()
async def the_waveform_of_one_character_is_as_drawn_by_hand(dut):
    loop = await Loop(dut).begin()
    await loop.send([0xA5], 128)
    first = loop.wave.index(0)
    assert [loop.wave[first + 4 + 8 * n] for n in range(10)] == [0, 1, 0, 1, 0, 0, 1, 0, 1, 1]
    assert loop.wave.count(0) == 5 * 8 and loop.received == [0xA5]


@cocotb.test()
async def every_byte_arrives_without_gaps_and_with_gaps(dut):
    shortest = 16 * int(dut.PARTS.value)
    for bit_time, gaps in ((shortest, False), (139, True)):
        loop = await Loop(dut).begin()
        await loop.send(range(256), bit_time, gaps)
        assert loop.received == list(range(256)) and loop.errors == 0


@cocotb.test()
async def without_a_stop_bit_the_character_is_dropped_and_reported(dut):
    loop = await Loop(dut).begin()
    for level in line([1, *character(0x55, None, stop=0), 1, *character(0x5A, None), 1], 16):
        await loop.clk(256, rx=level)
    assert loop.received == [0x5A] and loop.errors == 1


@cocotb.test()
async def bit_times_may_differ_by_4_percent(dut):
    for percent in (96, 104):
        loop = await Loop(dut).begin()
        sent = [0x00, 0xFF, 0x80, 0x01]
        for level in line(
            [1, *(b for byte in sent for b in character(byte, None)), 1, 1],
            Fraction(16 * percent, 100),
        ):
            await loop.clk(256, rx=level)
        assert loop.received == sent


@cocotb.test()
async def noise_matches_the_models(dut):
    loop = await Loop(dut).begin()
    for _ in range(300):
        bit_time, level = random.choice([64, 80, 128, 133, 256]), random.choice([None, 0, 1])
        for _ in range(random.randrange(1, 60)):
            await loop.clk(bit_time, random.choice([None, random.getrandbits(8)]), level)


@cocotb.test(skip=not sigrok.installed())
async def sigrok_reads_8n1(dut):
    """At 115 200 baud and 4 MHz."""
    loop = await Loop(dut).begin()
    sent = [0xA5, 0x00, 0xFF, *(random.getrandbits(8) for _ in range(20))]
    await loop.send(sent, 555)
    heard = sigrok.uart(loop.wave, 4_000_000, "baudrate=115200")
    assert heard == [f"{byte:02X}" for byte in sent]


@cocotb.test()
async def bits_of_5_cycles_may_differ_by_2_percent(dut):
    """12 Mbaud at 60 MHz; the edges come at any part of a cycle."""
    needs(int(dut.PARTS.value) == 4, "a bit of 5 cycles has 4 parts")
    for percent in (98, 100, 102):
        for phase in range(5):
            loop = await Loop(dut).begin()
            sent = [0x00, 0xFF, 0x80, 0x01, 0x55]
            bits = [1, *(b for byte in sent for b in character(byte, None)), 1, 1]
            levels = line(bits, Fraction(5 * percent, 100), Fraction(phase, 5))
            for level in levels:
                await loop.clk(80, rx=level)
            assert loop.received == sent, f"{percent} %, {phase}"


@pytest.mark.parametrize("parts", [8, 4])
def test_character_loop(parts):
    run("uart_loop", __file__, PARTS=parts)

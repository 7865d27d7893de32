# SPDX-License-Identifier: Apache-2.0
"""angle_frame: a frame by hand, damage of every byte and bit, pauses, gaps of the sequence, age,
and random bytes against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb import bench
from tb.peripheral.angle_frame import AngleFrame, crc16, frame

GAP = 40


class Line:
    def __init__(self, dut):
        self.dut, self.gap, self.stale_after, self.angles = dut, GAP, 0, []
        self.model = AngleFrame(int(dut.W.value))

    async def begin(self):
        await bench.start(
            self.dut,
            gap=self.gap,
            stale_after=0,
            byte_valid=0,
            byte_data=0,
            framing_error=0,
            clear=0,
        )
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        return self

    async def clk(self, byte=None, framing_error=0, clear=0, rst=0, n=1):
        d = self.dut
        d.gap.value, d.stale_after.value, d.rst.value = self.gap, self.stale_after, rst
        d.byte_valid.value, d.byte_data.value, d.framing_error.value, d.clear.value = (
            byte is not None,
            byte or 0,
            framing_error,
            clear,
        )
        for _ in range(n):
            await FallingEdge(d.clk)
            want = self.model.step(self.gap, self.stale_after, byte, framing_error, clear, rst)
            pins = (
                d.valid,
                d.angle,
                d.sequence_number,
                d.age,
                d.stale,
                d.crc_errors,
                d.broken,
                d.missed,
            )
            got = tuple(None if w is None else int(p.value) for p, w in zip(pins, want))
            assert got == want, f"{got} where the model has {want}"
            if got[0]:
                self.angles.append(got[1:3])
        return got

    async def send(self, data, pause=9):
        for byte in data:
            await self.clk(byte)
            await self.clk(n=pause)


@cocotb.test()
async def one_frame_by_hand(dut):
    line = await Line(dut).begin()
    assert crc16(b"123456789") == 0x29B1  # the check value of this CRC in its catalogue
    data = [0xA5, 0x07, 0x78, 0x56, 0x34, 0x12]
    crc = crc16(data)
    await line.send([*data, crc & 255, crc >> 8])
    assert line.angles == [(0x12345678, 0x07)]


@cocotb.test()
async def latency_is_2_and_age_counts_from_the_first_byte(dut):
    line = await Line(dut).begin()
    data = frame(1, 0xFFFFFFFF)
    await line.send(data[:7], pause=3)  # 28 cycles
    assert (await line.clk(data[7]))[0] == 0
    got = await line.clk()
    assert got[0] == 1 and got[3] == 28 + 2
    assert (await line.clk(n=100))[3] == 130
    line.stale_after = 200
    assert (await line.clk(n=70))[3:5] == (200, 0)
    assert (await line.clk())[3:5] == (201, 1)
    await line.send(frame(2, 0))
    assert (await line.clk())[4] == 0


@cocotb.test()
async def any_damaged_byte_costs_one_frame(dut):
    line = await Line(dut).begin()
    await line.send(frame(0, 1))
    for index in range(8):
        for bit in range(8):
            bad = bytearray(frame(1, 0xA5A5A5A5 if bit == 3 else 0x01020304))
            bad[index] ^= 1 << bit
            await line.send(bad)
            await line.clk(n=GAP + 2)
            line.angles.clear()
            await line.send(frame(0, 77))
            await line.clk(n=GAP + 2)
            assert line.angles == [(77, 0)], (index, bit)


@cocotb.test()
async def kinds_of_errors_are_counted_apart(dut):
    line = await Line(dut).begin()
    await line.send(frame(250, 5))
    await line.send(frame(4, 6))  # nine frames are missing
    assert (await line.clk())[5:] == (0, 0, 9)
    await line.send(frame(5, 6)[:7] + b"\x00")
    assert (await line.clk())[5:] == (1, 0, 9)
    await line.send(frame(6, 6)[:4])
    assert (await line.clk(n=GAP - 9))[5:] == (1, 0, 9)
    assert (await line.clk(n=2))[5:] == (1, 1, 9)
    await line.send(frame(6, 6)[:4])
    assert (await line.clk(framing_error=1))[5:] == (1, 2, 9)
    assert (await line.clk(framing_error=1))[5:] == (
        1,
        2,
        9,
    )  # outside a frame it belongs to no frame
    assert (await line.clk(clear=1))[5:] == (0, 0, 0)
    await line.send(frame(4, 6))  # the same number again: 255 are missing
    for _ in range(2):
        await line.send(frame(3, 6))
    assert (await line.clk())[7] == min(255 + 254 + 255, line.model.top)


@cocotb.test()
async def garbage_between_frames_is_passed_over(dut):
    line = await Line(dut).begin()
    for number in range(20):
        await line.send(
            bytes(random.choice([0x00, 0x5A, 0xFF]) for _ in range(random.randrange(12))),
            pause=random.randrange(1, 12),
        )
        await line.send(frame(number, number))
    assert line.angles == [(n, n) for n in range(20)]


@cocotb.test()
async def reset_in_mid_frame_forgets_it(dut):
    line = await Line(dut).begin()
    await line.send(frame(3, 9))
    await line.send(frame(4, 9)[:5])
    assert (await line.clk(rst=1))[4:] == (1, 0, 0, 0)
    await line.send(frame(4, 9)[5:])
    assert len(line.angles) == 1


@cocotb.test()
async def counts_stop_at_their_end(dut):
    line = await Line(dut).begin()
    for _ in range(line.model.top + 3 if line.model.top < 300 else 3):  # W = 8 reaches it
        await line.send(frame(0, 0)[:2], pause=1)
        await line.clk(framing_error=1)
    assert int(dut.broken.value) == min(line.model.top, line.model.broken)


@cocotb.test()
async def any_bytes_match_the_model(dut):
    line = await Line(dut).begin()
    for n in range(300):
        line.gap, line.stale_after = (
            random.choice([0, 3, GAP, 0xFFFFFF]),
            random.choice([0, 100, 0xFFFFFFFF]),
        )
        data = bytearray(
            frame(
                random.choice([n & 255, random.getrandbits(8)]),
                random.choice([0, 0xA5A5A5A5, random.getrandbits(32)]),
            )
        )
        if random.random() < 0.3:
            data[random.randrange(8)] ^= 1 << random.randrange(8)
        for byte in data[: random.choice([8, 8, 8, 5])]:
            await line.clk(
                byte,
                int(random.random() < 0.02),
                int(random.random() < 0.01),
                int(random.random() < 0.004),
            )
            if random.random() < 0.9:
                await line.clk(framing_error=int(random.random() < 0.01), n=random.randrange(1, 6))


def test_angle_frame():
    bench.run("angle_frame", __file__)


def test_angle_frame_with_short_counts():
    bench.run("angle_frame", __file__, W=8)

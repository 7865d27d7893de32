# SPDX-License-Identifier: Apache-2.0
"""crc32_serial: the check value of the catalogue, start in every position, each bit of the CRC-32
compared, and random bytes against zlib in every cycle.
"""

import random
import zlib

import cocotb
from cocotb.triggers import FallingEdge

from tb.bench import run, start
from tb.serial.crc32_serial import CYCLES, Crc32Serial


class Bench:
    """The design with the model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, Crc32Serial()

    async def begin(self):
        await start(self.dut, start=0, valid=0, data=0, check=0)
        await self.clk(rst=1)
        return self

    async def clk(self, start=0, valid=0, data=None, check=None, rst=0):
        d = self.dut
        d.start.value, d.valid.value, d.rst.value = start, valid, rst
        if data is not None:
            d.data.value, d.check.value = data, check or 0
        await FallingEdge(d.clk)
        busy, done, wrong, crc = self.model.step(start, valid, data, check, rst)
        assert (int(d.busy.value), int(d.done.value)) == (busy, done)
        assert wrong is None or int(d.wrong.value) == wrong
        assert crc is None or int(d.crc.value) == crc
        return done

    async def byte(self, data, start=0, check=0):
        """A byte and the cycles that it takes."""
        await self.clk(start, 1, data, check)
        return [await self.clk() for _ in range(CYCLES)]

    async def bytes(self, data, check=0):
        for n, byte in enumerate(data):
            await self.byte(byte, int(n == 0 and not check), check)


@cocotb.test()
async def latency_is_9_and_the_check_value_is_cbf43926(dut):
    bench = await Bench(dut).begin()
    assert await bench.byte(ord("1"), 1) == [0] * 7 + [1]
    for byte in b"23456789":
        await bench.byte(byte)
    assert int(dut.crc.value) == 0xCBF43926


@cocotb.test()
async def start_begins_again_alone_or_with_the_first_byte(dut):
    bench = await Bench(dut).begin()
    await bench.byte(0x55)
    await bench.clk(start=1)
    assert int(dut.crc.value) == 0
    await bench.byte(0xA5)
    assert int(dut.crc.value) == zlib.crc32(b"\xa5")
    await bench.byte(0x5A, start=1)
    assert int(dut.crc.value) == zlib.crc32(b"\x5a")
    await bench.clk(rst=1)
    assert int(dut.crc.value) == 0


@cocotb.test()
async def each_of_the_32_bits_is_compared(dut):
    bench = await Bench(dut).begin()
    for bit in [*range(32), None]:
        body = random.randbytes(3)
        crc = zlib.crc32(body) ^ (0 if bit is None else 1 << bit)
        await bench.bytes(body)
        await bench.bytes(crc.to_bytes(4, "little"), check=1)
        assert int(dut.wrong.value) == int(bit is not None), bit


@cocotb.test()
async def without_a_byte_nothing_is_compared(dut):
    bench = await Bench(dut).begin()
    await bench.bytes(b"\x11\x22")
    await bench.bytes(zlib.crc32(b"\x11\x22").to_bytes(4, "little"), check=1)
    for data in (0x00, 0xFF) * 3:
        await bench.clk(data=data, check=1)
        assert not int(dut.wrong.value)


@cocotb.test()
async def every_byte_as_often_as_they_may_come_gives_what_zlib_gives(dut):
    bench = await Bench(dut).begin()
    for data in range(256):
        await bench.byte(data, 1)
        assert int(dut.crc.value) == zlib.crc32(bytes([data])), f"byte {data:#04x}"
    for _ in range(200):
        for _ in range(random.randrange(4)):
            await bench.clk(rst=int(random.random() < 0.02))
        await bench.byte(random.getrandbits(8), int(random.random() < 0.1))


def test_crc32_serial():
    run("crc32_serial", __file__)

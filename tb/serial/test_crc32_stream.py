# SPDX-License-Identifier: Apache-2.0
"""crc32_stream: the check value of the catalogue, start in every position, and random bytes against
zlib in every cycle.
"""

import random
import zlib

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.crc32_stream import Crc32Stream


async def byte(dut, data, start=0):
    """A byte and the cycles that it takes."""
    crc = await clk(dut, start, 1, data)
    for _ in range(pause(dut)):
        crc = await clk(dut)
    return crc


def pause(dut):
    bits = int(dut.BITS.value)
    return 0 if bits == 8 else 8 // bits


async def clk(dut, start=0, valid=0, data=0, rst=0):
    dut.start.value, dut.valid.value, dut.data.value, dut.rst.value = start, valid, data, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.crc.value)


@cocotb.test()
async def latency_is_1_or_8_over_bits_more_and_the_check_value_is_cbf43926(dut):
    await start(dut, start=0, valid=0, data=0)
    assert [await byte(dut, c) for c in b"123456789"][-1] == 0xCBF43926


@cocotb.test()
async def start_begins_again_alone_or_with_the_first_byte(dut):
    await start(dut, start=0, valid=0, data=0)
    await byte(dut, 0x55)
    assert await clk(dut, start=1) == 0
    assert await byte(dut, 0xA5) == zlib.crc32(b"\xa5")
    assert await byte(dut, 0x5A, start=1) == zlib.crc32(b"\x5a")
    assert await clk(dut, rst=1, valid=1, data=0x5A) == 0


@cocotb.test()
async def every_byte_as_often_as_they_may_come_gives_what_zlib_gives(dut):
    await start(dut, start=0, valid=0, data=0)
    model = Crc32Stream(int(dut.BITS.value))
    for data in range(256):
        assert await byte(dut, data, 1) == zlib.crc32(bytes([data])), f"byte {data:#04x}"
    model.crc = zlib.crc32(b"\xff")
    for n in range(3000):
        free = not model.left
        word = (
            int(free and random.random() < 0.02),
            free and random.getrandbits(1),
            random.getrandbits(8),
            int(random.random() < 0.01),
        )
        crc, want = await clk(dut, *word), model.step(*word)
        assert want in (crc, None), f"cycle {n}"


@pytest.mark.parametrize("bits", [8, 2, 1])
def test_crc32_stream(bits):
    run("crc32_stream", __file__, BITS=bits)

# SPDX-License-Identifier: Apache-2.0
"""crc32_stream: the check value of the catalogue, start in every position, and random bytes against
zlib in every cycle.
"""

import random
import zlib

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.serial.crc32_stream import Crc32Stream


async def clk(dut, start=0, valid=0, data=0, rst=0):
    dut.start.value, dut.valid.value, dut.data.value, dut.rst.value = start, valid, data, rst
    await RisingEdge(dut.clk)
    await FallingEdge(dut.clk)
    return int(dut.crc.value)


@cocotb.test()
async def latency_is_1_and_the_check_value_is_cbf43926(dut):
    await start(dut, start=0, valid=0, data=0)
    assert [await clk(dut, valid=1, data=c) for c in b"123456789"][-1] == 0xCBF43926


@cocotb.test()
async def start_begins_again_before_the_first_byte(dut):
    await start(dut, start=0, valid=0, data=0)
    await clk(dut, valid=1, data=0x55)
    assert await clk(dut, start=1) == 0
    assert await clk(dut, valid=1, data=0xA5) == zlib.crc32(b"\xa5")
    assert await clk(dut, start=1, valid=1, data=0x5A) == 0
    assert await clk(dut, valid=1, data=0x5A) == zlib.crc32(b"\x5a")
    assert await clk(dut, rst=1, valid=1, data=0x5A) == 0


@cocotb.test()
async def every_byte_in_every_cycle_gives_what_zlib_gives(dut):
    await start(dut, start=0, valid=0, data=0)
    model = Crc32Stream()
    for data in range(256):
        for begins in (1, 0):
            word = begins, 1 - begins, data
            assert await clk(dut, *word) == model.step(*word), f"byte {data:#04x}"
    for n in range(3000):
        word = (
            int(random.random() < 0.02),
            random.getrandbits(1),
            random.getrandbits(8),
            int(random.random() < 0.01),
        )
        assert await clk(dut, *word) == model.step(*word), f"cycle {n}"


def test_crc32_stream():
    run("crc32_stream", __file__)

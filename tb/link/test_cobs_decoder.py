# SPDX-License-Identifier: Apache-2.0
"""cobs_decoder: packets of the package `cobs`, blocks of all lengths, cut packets, lost bytes, and
noise; the model runs beside it in every cycle.
"""

import random

import cocotb
from cobs import cobs
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.link.cobs_decoder import CobsDecoder


class Decoder:
    def __init__(self, dut):
        self.dut, self.model = dut, CobsDecoder()
        self.content, self.packets, self.broken = bytearray(), [], False

    async def begin(self):
        await start(self.dut, valid=0, data=0, lost=0)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        return self

    async def clk(self, valid=0, data=0, lost=0, rst=0):
        for name, level in dict(valid=valid, data=data, lost=lost, rst=rst).items():
            getattr(self.dut, name).value = level
        await Timer(1, "ns")  # much less than a cycle
        want = self.model.outputs(valid, data, lost)
        got = tuple(int(getattr(self.dut, n).value) for n in ("valid_out", "ends", "broken"))
        assert got == (want[0], *want[2:])
        if want[0]:
            assert int(self.dut.data_out.value) == want[1]
            self.content.append(want[1])
        self.broken = self.broken or want[3]
        if want[2]:
            self.packets.append(None if self.broken else bytes(self.content))
            self.content.clear()
            self.broken = False
        self.model.step(valid, data, rst)
        await FallingEdge(self.dut.clk)

    async def send(self, line, gaps=False):
        """Returns the packets that end in these bytes; None for a broken one."""
        self.packets = []
        for byte in line:
            await self.clk(1, byte)
            for _ in range(random.randrange(4) if gaps else 0):
                await self.clk()
        return self.packets


def some(length):
    return bytes(random.choice([0, 0xFF, random.randrange(256)]) for _ in range(length))


@cocotb.test()
async def latency_is_0_from_valid_to_valid_out_ends_and_broken(dut):
    decoder = await Decoder(dut).begin()
    assert await decoder.send(b"\x03\x11\x22\x02\x33\x00") == [b"\x11\x22\x00\x33"]
    assert await decoder.send(b"\x03\x11\x00\x00") == [None, b""]


@cocotb.test()
async def packets_of_all_lengths_arrive(dut):
    decoder = await Decoder(dut).begin()
    lengths = [*range(1, 8), 253, 254, 255, 256, 508, 509, 512]
    contents = [some(n) for n in lengths] + [bytes([7]) * n for n in lengths] + [bytes(300)]
    codes = [255 - (1 << n) for n in range(8)]  # one bit from that of a block without a zero
    contents += [bytes([7]) * (code - 1) + b"\0\7" for code in codes]
    for content in contents:
        line = b"\0" + cobs.encode(content) + b"\0"
        assert await decoder.send(line, len(line) < 20) == [b"", content]


@cocotb.test()
async def a_cut_packet_is_broken_or_shorter_and_the_next_one_arrives(dut):
    decoder = await Decoder(dut).begin()
    for _ in range(40):
        content = some(random.randrange(1, 40))
        line = cobs.encode(content)
        cut = line[: random.randrange(len(line))]
        first, second = await decoder.send(cut + b"\0" + line + b"\0")
        assert second == content and first != content
    await decoder.clk(lost=1)
    assert await decoder.send(b"\0") == [None]


@cocotb.test()
async def any_bytes_match_the_model(dut):
    decoder = await Decoder(dut).begin()
    for _ in range(3000):
        byte = random.choice([0, 1, 2, 3, 255, random.randrange(256)])
        rare = lambda one_in: int(random.randrange(one_in) == 0)
        await decoder.clk(random.getrandbits(1), byte, rare(50), rare(200))


def test_cobs_decoder():
    run("cobs_decoder", __file__)

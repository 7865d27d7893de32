# SPDX-License-Identifier: Apache-2.0
"""cobs_encoder: packets of all lengths against the package `cobs`, a line that takes its time, and
random traffic; the model runs beside it in every cycle.
"""

import random

import cocotb
from cobs import cobs
from cocotb.triggers import FallingEdge, Timer

from tb.bench import run, start
from tb.link.cobs_encoder import CobsEncoder


class Encoder:
    def __init__(self, dut):
        self.dut, self.model = dut, CobsEncoder(int(dut.A.value))
        self.sent, self.cycles = bytearray(), 0

    async def begin(self):
        await start(self.dut, valid=0, data=0, last=0, ready=0)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        return self

    async def clk(self, valid=0, data=0, last=0, ready=0, rst=0):
        """One cycle; returns taken and sends."""
        inputs = dict(valid=valid, data=data, last=last, ready=ready, rst=rst)
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await Timer(1, "ns")  # much less than a cycle
        taken, sends, byte, busy = self.model.outputs(valid)
        if self.cycles:
            got = tuple(int(getattr(self.dut, n).value) for n in ("taken", "sends", "busy"))
            assert got == (taken, sends, busy), f"cycle {self.cycles}"
            if sends:
                assert int(self.dut.data_out.value) == byte, f"cycle {self.cycles}"
        if sends and ready:
            self.sent.append(byte)
        self.cycles += 1
        self.model.step(**inputs)
        await FallingEdge(self.dut.clk)
        return taken, sends

    async def send(self, content, pause=1):
        """Sends a packet; the line takes a byte in each `pause` cycles. Returns its bytes."""
        self.sent.clear()
        left = list(content)
        while left or self.model.outputs(0)[3]:
            ready = int(self.cycles % pause == 0)
            byte = left[0] if left else 0
            taken, _ = await self.clk(int(bool(left)), byte, int(len(left) == 1), ready)
            if taken:
                left.pop(0)
        return bytes(self.sent)


def framed(content):
    return b"\0" + cobs.encode(content) + b"\0"


@cocotb.test()
async def latency_is_2_from_what_ends_a_block_to_its_first_byte(dut):
    encoder = await Encoder(dut).begin()
    await encoder.clk(1, 5, ready=1)  # the start of a packet
    assert [(await encoder.clk(ready=1))[1] for _ in range(4)] == [False, True, False, False]
    await encoder.clk(1, 5, ready=1)
    for data, last, after in ((0, 0, 2), (7, 1, 3)):
        await encoder.clk(1, data, last, ready=1)
        sends = [(await encoder.clk(ready=1))[1] for _ in range(9)]
        assert sends.index(True) + 1 == after
    for _ in range(254):
        await encoder.clk(1, 9, ready=1)
    await encoder.send([9] * 3)


@cocotb.test()
async def packets_of_all_lengths_are_those_of_the_package(dut):
    encoder = await Encoder(dut).begin()
    lengths = [*range(1, 8), 253, 254, 255, 256, 508, 509, 512]
    for fill in (lambda: 7, lambda: 0, lambda: random.choice([0, 255, random.randrange(256)])):
        for length in lengths:
            content = bytes(fill() for _ in range(length))
            assert await encoder.send(content) == framed(content)


@cocotb.test()
async def a_slow_line_gets_the_longest_packet_whole(dut):
    encoder = await Encoder(dut).begin()
    for content in (bytes([7]) * 512, bytes(512), bytes(1 + n % 255 for n in range(512))):
        assert await encoder.send(content, pause=7) == framed(content)


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    encoder = await Encoder(dut).begin()
    for _ in range(6000):
        data = random.choice([0, *[random.randrange(256)] * 60])
        rare = lambda one_in: int(random.randrange(one_in) == 0)
        await encoder.clk(random.getrandbits(1), data, rare(300), rare(4), rare(1500))


def test_cobs_encoder():
    run("cobs_encoder", __file__)

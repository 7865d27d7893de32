# SPDX-License-Identifier: Apache-2.0
"""link_spi: transfers of all lengths and at all rates, cut in any bit, with replies that come soon,
late or not at all; the model runs beside it in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly

from moire.made import link_tables as layout
from tb.bench import run, start
from tb.link.link_spi import NAMES, LinkSpi
from tb.ports import Ports

IDLE = dict(cs_n=1, sclk=0, mosi=0, accepted=0, reply_valid=0, reply_data=0, reply_last=0)
REPLY = bytes([layout.KIND_REPLY, 0x00, 0xFF, 0x5A])
PLAYING = 3  # cycles of a short request


class Follower:
    """The design with its model beside it, a link that answers, and a host at the pins."""

    def __init__(self, dut):
        self.dut, self.model, self.cycles = dut, LinkSpi(), 0
        self.ports = Ports(dut)
        self.settings = dict(writes=0, cs_n=1, sclk=0, mosi=0)
        self.accepts, self.playing, self.reply = True, PLAYING, REPLY
        self.begin()

    def begin(self):
        """Forget what has happened."""
        self.left, self.at, self.accepted = b"", 0, 0  # of the reply that is offered
        self.request, self.requests, self.breaks, self.cuts = b"", [], 0, 0

    async def clk(self, rst=0, **levels):
        """One cycle; returns the outputs by name."""
        self.settings |= levels
        offers = bool(self.left) and self.cycles >= self.at
        inputs = self.settings | {
            "rst": rst,
            "accepted": self.accepted,
            "reply_valid": int(offers),
            "reply_data": self.left[0] if offers else 0x55,
            "reply_last": int(offers and len(self.left) == 1),
        }
        self.ports.drive(inputs)
        await ReadOnly()
        want = dict(zip(NAMES, self.model.outputs(**inputs), strict=True))
        self.ports.check(want, self.cycles)
        self.model.step(**inputs)
        self.answer(want, offers)
        self.cycles += 1
        await FallingEdge(self.dut.clk)
        return want

    def answer(self, want, offers):
        """What the link behind it does."""
        if offers and want["reply_taken"]:
            self.left = self.left[1:]
        if self.accepted:
            self.left, self.at = self.reply, self.cycles + self.playing
        self.accepted = 0
        self.cuts += want["cut"]
        if want["valid"]:
            self.request += bytes([want["data"]])
        if want["ends"]:
            self.breaks += want["broken"]
            if not want["broken"]:
                self.requests.append(self.request)
                self.accepted = int(self.accepts and not self.left)
            self.request = b""

    async def bits(self, bits, high=1, low=1):
        """Bits of the host; returns what it has read at each rise of the clock."""
        read = []
        for bit in bits:
            for _ in range(low):
                await self.clk(sclk=0, mosi=bit)
            read.append((await self.clk(sclk=1))["miso"])
            for _ in range(high - 1):
                await self.clk()
        await self.clk(sclk=0)
        return read

    async def transfer(self, sent, bits=None, **rate):
        """A transfer of bytes, or of its first bits; returns the bytes that the host has read."""
        given = [byte >> n & 1 for byte in sent for n in range(7, -1, -1)]
        await self.clk(cs_n=0)
        read = await self.bits(given[:bits], **rate)
        await self.clk(cs_n=1)
        await self.clk()
        return bytes(
            int("".join(map(str, read[n : n + 8])), 2) for n in range(0, len(read) // 8 * 8, 8)
        )


async def begin(dut):
    await start(dut, **IDLE, writes=0)
    await FallingEdge(dut.clk)
    follower = Follower(dut)
    await follower.clk(rst=1)
    return follower


def request_of(writes=0):
    return random.randbytes(4 * (writes + layout.FRAME_WORDS))


@cocotb.test()
async def a_transfer_brings_the_request_and_the_reply_after_bytes_of_zero(dut):
    follower = await begin(dut)
    for turnround in (1, 2, 9):
        for rate in ({}, {"high": 3}, {"low": 3, "high": 2}):
            follower.begin()
            sent = request_of()
            read = await follower.transfer(sent + bytes(turnround + len(REPLY)), **rate)
            assert follower.requests == [sent]
            assert read == bytes(len(sent) + 1) + REPLY + bytes(turnround - 1)
            assert not follower.cuts and not follower.breaks


@cocotb.test()
async def latency_is_0_from_a_bit_to_valid_1_from_the_last_byte_to_ends_and_1_to_miso(dut):
    follower = await begin(dut)
    await follower.clk(cs_n=0)
    for n in range(8 * len(request_of())):
        await follower.clk(sclk=0)
        seen = await follower.clk(sclk=1)
        assert seen["valid"] == int(n % 8 == 7) and not seen["ends"]
    assert (await follower.clk())["ends"] == 1
    for n in range(8):
        assert (await follower.clk(sclk=0))["miso"] == 0
        assert (await follower.clk(sclk=1))["miso"] == 0, f"bit {n}"
    assert (await follower.clk())["miso"] == 1


@cocotb.test()
async def a_clock_that_idles_high_works_as_well(dut):
    follower = await begin(dut)
    sent = request_of()
    await follower.clk(sclk=1)
    await follower.clk(cs_n=0)
    read = []
    for byte in sent + bytes(9):
        for n in range(7, -1, -1):
            await follower.clk(sclk=0, mosi=byte >> n & 1)
            read.append((await follower.clk(sclk=1))["miso"])
    await follower.clk(cs_n=1)
    assert follower.requests == [sent] and not follower.cuts
    words = [read[n : n + 8] for n in range(0, len(read), 8)]
    assert REPLY in bytes(int("".join(map(str, word)), 2) for word in words)


@cocotb.test()
async def requests_of_both_ends_of_the_range_and_of_random_lengths_are_taken_whole(dut):
    follower = await begin(dut)
    for writes in (0, layout.MOST_VALUES, random.randrange(20)):
        follower.begin()
        await follower.clk(writes=writes)
        sent = request_of(writes)
        assert REPLY in await follower.transfer(sent + bytes(8))
        assert follower.requests == [sent]


@cocotb.test()
async def a_transfer_that_is_cut_in_any_bit_of_its_request_is_broken(dut):
    follower = await begin(dut)
    whole, most = 8 * len(request_of()), 8 * len(request_of(layout.MOST_VALUES))
    for writes, cuts in (
        (0, (*range(1, 10), whole - 8, whole - 1, random.randrange(1, whole))),
        (layout.MOST_VALUES, [8 << n for n in range(most.bit_length()) if 8 << n < most]),
    ):
        await follower.clk(writes=writes)
        for bits in cuts:
            follower.begin()
            read = await follower.transfer(request_of(writes), bits)
            assert (follower.breaks, follower.cuts, follower.requests) == (1, 1, [])
            assert not any(read) and not follower.left
    follower.begin()
    await follower.transfer(b"")
    assert (follower.breaks, follower.cuts) == (0, 0), "a transfer without a bit is nothing"


@cocotb.test()
async def what_is_left_of_a_cut_reply_never_comes_in_a_later_transfer(dut):
    follower = await begin(dut)
    sent = request_of()
    whole = 8 * (len(sent) + 1 + len(REPLY))
    for bits in (8 * len(sent), whole - 33, whole - 20, whole - 8, whole - 1):
        for playing in (3, 60):
            follower.begin()
            follower.playing = playing
            await follower.transfer(sent + bytes(20), bits)
            assert (follower.breaks, follower.cuts, follower.requests) == (0, 1, [sent])
            follower.playing = PLAYING
            read = await follower.transfer(sent + bytes(20))
            assert read == bytes(len(sent) + 1) + REPLY + bytes(19 - len(REPLY))
    follower.begin()
    await follower.transfer(sent + bytes(20), whole)
    assert not follower.cuts


@cocotb.test()
async def a_refused_request_has_no_reply_even_if_an_older_one_comes_meanwhile(dut):
    follower = await begin(dut)
    sent = request_of()
    follower.accepts = False
    assert not any(await follower.transfer(sent + bytes(20)))
    assert not follower.cuts
    follower.accepts, follower.playing = True, 16 * len(sent) + 40
    await follower.transfer(sent + bytes(1))
    assert not any(await follower.transfer(sent + bytes(20))), "the reply to another request"


@cocotb.test()
async def edges_of_the_clock_count_only_while_cs_n_is_low(dut):
    follower = await begin(dut)
    for _ in range(20):
        await follower.bits([1])
    assert not follower.breaks and not follower.cuts
    sent = request_of()
    assert REPLY in await follower.transfer(sent + bytes(8)) and follower.requests == [sent]
    for more in range(128, 137):
        follower.begin()
        await follower.transfer(sent + bytes(20), 8 * len(sent) + more)
        assert follower.cuts == (more % 8 > 0), "a byte after the reply that is not whole"


@cocotb.test()
async def a_reset_in_a_transfer_ends_it(dut):
    follower = await begin(dut)
    sent = request_of()
    for bits in (5, 8 * len(sent) + 20):
        await follower.clk(cs_n=0)
        await follower.bits([1] * bits)
        await follower.clk(rst=1)
        follower.begin()
        await follower.clk(cs_n=1)
        assert not follower.cuts
        assert REPLY in await follower.transfer(sent + bytes(8)) and follower.requests == [sent]


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    follower = await begin(dut)
    for _ in range(8):
        follower.playing, follower.accepts = random.randrange(100), random.randrange(4) > 0
        rate = dict(high=random.choice([1, 1, 2, 3]), low=random.choice([1, 2]))
        sent = request_of() + random.randbytes(random.randrange(20))
        bits = random.choice([None, random.randrange(8 * len(sent))])
        await follower.transfer(sent, bits, **rate)
        for _ in range(random.randrange(10)):
            await follower.clk(sclk=random.getrandbits(1), rst=int(random.randrange(20) == 0))
    for _ in range(4000):
        one_in = lambda n: int(random.randrange(n) == 0)
        await follower.clk(
            cs_n=follower.settings["cs_n"] ^ one_in(4 if follower.settings["cs_n"] else 700),
            sclk=random.getrandbits(1),
            mosi=random.getrandbits(1),
            rst=one_in(1000),
        )


def test_link_spi():
    run("link_spi", __file__)

# SPDX-License-Identifier: Apache-2.0
"""link_port: requests of the host's codec on its serial line, in datagrams or in SPI transfers are
answered there and reach the register bus; damaged lines; the watchdog; and a node without it. Its
blocks have models of their own.
"""

import random

import cocotb
import pytest
from cobs import cobs
from cocotb.triggers import FallingEdge, ReadOnly

from moire.bus.cobs import sealed, unstuff
from moire.bus.link import Link, Spare
from moire.bus.link_spi import reply_bytes, reply_in
from moire.made.registers import FIELDS
from tb.bench import needs, run, start
from tb.link.link_pll import FULL
from tb.ports import Ports
from tb.serial.uart_rx import UartRx, character, line

SESSION = 0x00BEEF
BIT = 5  # cycles: 12 Mbaud at 60 MHz
TURNAROUND = 2  # bits
CLK_HZ = 1_000_000
IDLE = dict(select=0, write=0, word=0, wdata=0, ready=1, link_rdata=0, now=0, link_rx=1)
IDLE |= dict(drive_on=0, udp_rx_valid=0, udp_rx_data=0, udp_rx_last=0, udp_rx_error=0)
IDLE |= dict(udp_rx_sender=0, udp_tx_ready=1, link_cs_n=1, link_sclk=0, link_mosi=0)
HOST = 0xC0A8_0101_0FA0  # address and port
PERIOD, HIGH = 5, 2  # cycles of the clock of the SPI
TURNROUND = 20  # bytes


class Port:
    """The port with a host at its line, and registers behind its register bus."""

    def __init__(self, dut):
        self.dut, self.receiver, self.heard = dut, UartRx(0, 4), bytearray()
        self.ports = Ports(dut)
        self.registers, self.answers, self.now = {}, [0, 0], 0
        self.drive_on, self.datagrams = 0, [bytearray()]
        self.driven, self.drops = 0, 0  # driver enable now, and how often it fell

    async def clk(self, rx=1, **inputs):
        ports = self.ports
        self.now += 1
        driven = ports["link_driver_enable"]
        assert driven or ports["link_tx"], "the line is idle without the driver"
        self.drops += self.driven and not driven
        self.driven = driven
        inputs = (
            IDLE
            | {
                "drive_on": self.drive_on,
                "now": self.now,
                "link_rx": rx,
                "link_rdata": self.answers.pop(0),
            }
            | inputs
        )
        ports.drive(inputs)
        await ReadOnly()
        answer = self.answers[-1]
        if ports["link_select"]:
            address = ports["link_address"]
            if ports["link_write"]:
                self.registers[address] = ports["link_wdata"]
            answer = self.registers.get(address, address + 1)
        self.answers.append(answer)
        valid, byte, *_ = self.receiver.step(ports["link_tx"], 16 * BIT)
        if valid:
            self.heard.append(byte)
        if ports["udp_tx_valid"]:
            self.datagrams[-1].append(ports["udp_tx_data"])
            if ports["udp_tx_last"]:
                assert ports["udp_tx_length"] == len(self.datagrams[-1])
                self.datagrams.append(bytearray())
        await FallingEdge(self.dut.clk)

    async def datagram(self, content, sender=HOST, error=0):
        """A datagram, and the one that answers it: (receiver, content); None if there is none."""
        self.datagrams = [bytearray()]
        for n, byte in enumerate(content):
            last = int(n == len(content) - 1)
            await self.clk(
                udp_rx_valid=1,
                udp_rx_data=byte,
                udp_rx_last=last,
                udp_rx_error=error and last,
                udp_rx_sender=sender,
            )
        for _ in range(200):
            await self.clk()
        if len(self.datagrams) < 2:
            return None
        return int(self.dut.udp_tx_receiver.value), bytes(self.datagrams[0])

    async def transfer(self, content, bits=None):
        """An SPI transfer at its highest rate, or its first bits; returns the bytes read."""
        await self.clk(link_cs_n=0)
        await self.clk(link_cs_n=0)
        read = []
        for n in range(8 * len(content) if bits is None else bits):
            bit = content[n // 8] >> 7 - n % 8 & 1
            for _ in range(PERIOD - HIGH):
                await self.clk(link_cs_n=0, link_mosi=bit)
            read.append(int(self.dut.link_miso.value))  # at the rise of the clock
            for _ in range(HIGH):
                await self.clk(link_cs_n=0, link_mosi=bit, link_sclk=1)
        for _ in range(2):
            await self.clk(link_cs_n=0)
        for _ in range(2):
            await self.clk()
        words = ["".join(map(str, read[n : n + 8])) for n in range(0, len(read), 8)]
        return bytes(int(word, 2) for word in words)

    async def write(self, register, **values):
        """A register of the port by its fields."""
        fields = [f for f in FIELDS if (f.block, f.register) == ("link", register)]
        word = sum(values.get(f.field, 0) << f.low for f in fields)
        await self.clk(select=1, write=1, word=fields[0].address(0) // 4 % 64, wdata=word)

    async def read(self, register):
        fields = [f for f in FIELDS if (f.block, f.register) == ("link", register)]
        await self.clk(select=1, word=fields[0].address(0) // 4 % 64)
        word = int(self.dut.rdata.value)
        return {f.field: f.value(word) for f in fields}

    async def set_up(self, enable=1):
        await self.write("bit_time", value=16 * BIT)
        for n, (write, read) in enumerate(((0x400, 0x410), (0x404, 0x414))):
            await self.write("entry_number", value=n)
            await self.write("entry", write=write, read=read)
        await self.write("session", value=SESSION)
        await self.write("lists", writes=2, reads=2)
        await self.write("watchdog_time", value=20)
        await self.write("enable", value=enable)
        return Link(SESSION, 2, 2)

    async def send(self, content, percent=100):
        """Bytes of the host, after the time that the node needs to let go of the line."""
        for _ in range(TURNAROUND * BIT):
            await self.clk()
        bits = [bit for byte in content for bit in character(byte, None)]
        for level in line([*bits, 1], BIT * percent / 100):
            await self.clk(level)

    async def reply(self, most=60 * 10 * BIT):
        """The content of the next packet of the port; None if there is none."""
        self.heard.clear()
        for _ in range(most):
            await self.clk()
            if self.heard.endswith(b"\0") and len(self.heard) > 1:
                assert self.heard[0] == 0
                return unstuff(bytes(self.heard[1:-1]))
        return None


async def begin(dut):
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    port = Port(dut)
    for _ in range(20):
        await port.clk()
    return port


def has(dut, carrier):
    built = int(dut.BUILT.value) and int(dut.CARRIER.value) == carrier
    needs(built, f"a node without a link of carrier {carrier}")


def has_line(dut):
    has(dut, 0)


def has_datagrams(dut):
    has(dut, 1)


def has_spi(dut):
    has(dut, 2)


@cocotb.test()
async def requests_on_the_line_are_played_and_answered(dut):
    has_line(dut)
    port = await begin(dut)
    host = await port.set_up()
    for value in range(3):
        request = host.request(0, [value, 7], Spare(0x500, 33))
        await port.send(sealed(request), random.choice([99, 100, 101]))
        reply = host.reply(await port.reply())
        assert reply and reply.values == (0x411, 0x415) and not any(reply.refused.values())
        assert port.registers == {0x400: value, 0x404: 7, 0x500: 33}
    assert await port.read("state") == dict(built=1, on=1, busy=0, expired=0, session=SESSION)
    for _ in range(4 * BIT):
        await port.clk()
    assert port.drops == 3, "the driver stays on during a reply"


@cocotb.test()
async def a_damaged_line_is_counted_and_the_next_request_is_answered(dut):
    has_line(dut)
    port = await begin(dut)
    host = await port.set_up()
    packet = host.request(0, [1, 2])
    bent = bytearray(packet)
    bent[5] ^= 4
    lost = cobs.encode(packet)[:-3] + b"\0"
    for sent in (sealed(bytes(bent)), lost):
        await port.send(sent)
        assert await port.reply(20 * BIT) is None
    for level in line([0] * 11 + [1], BIT):  # a break: a byte without a stop bit
        await port.clk(level)
    assert not port.registers
    assert await port.read("framing_errors") == dict(value=1)
    await port.send(sealed(packet))
    reply = host.reply(await port.reply())
    assert reply and reply.refused["damaged"] == 3 and port.registers == {0x400: 1, 0x404: 2}
    assert (await port.read("refused"))["damaged"] == 3


@cocotb.test()
async def the_watchdog_expires_without_requests_and_only_while_the_link_is_on(dut):
    needs(int(dut.BUILT.value), "a node without a link")
    port = await begin(dut)
    await port.set_up(enable=0)
    for _ in range(21_000):
        await port.clk()
    assert not int(dut.watchdog_expired.value)
    await port.write("enable", value=1)
    for _ in range(20_010):
        await port.clk()
    assert int(dut.watchdog_expired.value) and (await port.read("state"))["expired"]


@cocotb.test()
async def without_a_link_nothing_answers_and_nothing_is_accessed(dut):
    needs(not int(dut.BUILT.value), "a node with a link")
    port = await begin(dut)
    host = await port.set_up()
    await port.send(sealed(host.request(0, [1, 2])))
    assert await port.reply(300) is None and not port.registers and not port.driven
    assert await port.read("state") == dict(built=0, on=0, busy=0, expired=0, session=0)
    assert not int(dut.watchdog_expired.value)


@cocotb.test()
async def requests_in_datagrams_are_played_and_answered_to_their_sender(dut):
    has_datagrams(dut)
    port = await begin(dut)
    host = await port.set_up()
    for value in range(3):
        request = host.request(0, [value, 7], Spare(0x500, 33))
        receiver, content = await port.datagram(request, HOST + value)
        reply = host.reply(content)
        assert receiver == HOST + value
        assert reply and reply.values == (0x411, 0x415) and not any(reply.refused.values())
        assert port.registers == {0x400: value, 0x404: 7, 0x500: 33}
    assert (int(dut.link_tx.value), int(dut.link_driver_enable.value)) == (1, 0)


@cocotb.test()
async def while_a_drive_is_on_datagrams_of_others_and_damaged_ones_are_refused(dut):
    has_datagrams(dut)
    port = await begin(dut)
    host = await port.set_up()
    assert await port.datagram(host.request(0, [1, 2]))
    port.drive_on = 1
    request = host.request(0, [3, 4])
    assert await port.datagram(request, HOST ^ 1) is None
    assert await port.datagram(request, error=1) is None
    assert port.registers == {0x400: 1, 0x404: 2}
    _, content = await port.datagram(request)
    refused = host.reply(content).refused
    assert (refused["foreign"], refused["damaged"]) == (1, 1)
    assert port.registers == {0x400: 3, 0x404: 4}
    assert await port.read("framing_errors") == dict(value=0)


@cocotb.test()
async def requests_in_spi_transfers_are_played_and_answered(dut):
    has_spi(dut)
    port = await begin(dut)
    host = await port.set_up()
    for value in range(3):
        request = host.request(0, [value, 7], Spare(0x500, 33))
        read = await port.transfer(request + bytes(TURNROUND + reply_bytes(host)))
        assert not any(read[: len(request)])
        reply = host.reply(reply_in(read, host))
        assert reply and reply.values == (0x411, 0x415) and not any(reply.refused.values())
        assert port.registers == {0x400: value, 0x404: 7, 0x500: 33}
    assert await port.read("framing_errors") == dict(value=0)


@cocotb.test()
async def damaged_and_cut_spi_transfers_are_counted_and_the_next_request_is_answered(dut):
    has_spi(dut)
    port = await begin(dut)
    host = await port.set_up()
    packet = host.request(0, [1, 2])
    whole = packet + bytes(TURNROUND + reply_bytes(host))
    bent = bytearray(whole)
    bent[5] ^= 4
    assert not any(await port.transfer(bytes(bent)))
    for bits in (1, 3, 100, 8 * len(packet) - 1):
        assert not any(await port.transfer(whole, bits))
    slipped = int.from_bytes(whole, "big") >> 1  # an edge too many at the begin
    assert not any(await port.transfer(slipped.to_bytes(len(whole), "big")))
    for _ in range(30):  # edges of another device's transfer
        for level in (1, 1, 0, 0):
            await port.clk(link_sclk=level, link_mosi=level)
    assert not port.registers and await port.read("framing_errors") == dict(value=4)
    read = await port.transfer(whole)
    reply = host.reply(reply_in(read, host))
    assert reply and reply.refused["damaged"] == 6 and port.registers == {0x400: 1, 0x404: 2}
    assert not any(await port.transfer(whole)), "it is replayed"
    again = host.request(0, [3, 4])
    await port.transfer(again + bytes(TURNROUND), 8 * (len(again) + TURNROUND))
    assert port.registers == {0x400: 3, 0x404: 4}, "a request is played when it is whole"
    last = host.request(0, [5, 6])
    read = await port.transfer(last + bytes(TURNROUND + reply_bytes(host)))
    assert host.reply(reply_in(read, host)).values == (0x411, 0x415)
    assert await port.read("framing_errors") == dict(value=5)
    assert (await port.read("refused")) == dict(damaged=6, foreign=0, wrong_length=0, replayed=1)


@cocotb.test()
async def requests_are_followed_and_the_registers_of_the_pll_show_it(dut):
    has_datagrams(dut)
    port, built = await begin(dut), int(dut.PLL.value)
    nothing = dict(built=built, locked=0, captured=0, phase_error=0)
    assert await port.read("pll_state") == nothing
    assert await port.read("read_time") == dict(value=0) or built
    await port.write("pll_period", value=2048)
    await port.write("capture_lead", value=300)
    host, late = await port.set_up(), -30
    for n in range(FULL + 3):
        while port.now % 2048 != (late if n == FULL + 2 else 0) % 2048:
            await port.clk()
        begun = port.now
        _, content = await port.datagram(host.request(0, [n, 7]))
        assert host.reply(content).values == (0x411, 0x415)
        assert (await port.read("pll_state"))["locked"] == int(built and n > FULL)
    assert (await port.read("pll_state"))["phase_error"] == built * late
    read = (await port.read("read_time"))["value"]
    expected = begun - late + len(host.request(0, [0, 0]))
    assert read == 0 or abs(expected - 300 - read) < 10
    assert bool(read) == bool(built)
    await port.write("enable", value=0)
    assert await port.read("pll_state") == nothing


@pytest.mark.parametrize(
    "built, carrier, pll", [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 2, 0), (0, 0, 0), (0, 0, 1)]
)
def test_link_port(built, carrier, pll):
    run("link_port", __file__, CLK_HZ=CLK_HZ, BUILT=built, CARRIER=carrier, PLL=pll)

# SPDX-License-Identifier: Apache-2.0
"""link_datagram: where a packet ends, whose request is foreign and where the reply goes; the model
runs beside it in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly

from moire.made import link_tables as layout
from tb.bench import run, start
from tb.link.link_datagram import LinkDatagram
from tb.ports import Ports

NAMED = ("rx_ready", "receiver", "length", "valid", "ends", "broken", "foreign")
IDLE = dict(rx_valid=0, rx_last=0, rx_error=0, sender=0, accepted=0)
FIRST, SECOND = 0xC0A8_0102_3039, 0xC0A8_0102_303A  # two ports of a host


class Datagrams:
    """The design with its model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.cycles = dut, LinkDatagram(), 0
        self.ports = Ports(dut)
        self.settings = dict(enable=1, reads=2, locked=0)

    async def clk(self, rst=0, **levels):
        """One cycle; returns the outputs by name."""
        inputs = IDLE | self.settings | levels | {"rst": rst}
        self.ports.drive(inputs)
        await ReadOnly()
        want = dict(zip(NAMED, self.model.outputs(**inputs), strict=True))
        self.ports.check(want, self.cycles)
        self.model.step(**inputs)
        self.cycles += 1
        await FallingEdge(self.dut.clk)
        return want

    async def send(self, sender, size=3, accepted=1):
        """A datagram, and whether its request is acted upon unless it is foreign. Returns whether
        it was foreign.
        """
        for n in range(size):
            await self.clk(rx_valid=1, rx_last=n == size - 1, sender=sender)
        foreign = (await self.clk())["foreign"]
        await self.clk(accepted=accepted and not foreign)
        return bool(foreign)


async def begin(dut):
    await start(dut, **IDLE, enable=0, reads=0, locked=0)
    await FallingEdge(dut.clk)
    datagrams = Datagrams(dut)
    await datagrams.clk(rst=1)
    return datagrams


@cocotb.test()
async def latency_is_0_from_a_byte_to_valid_and_1_from_the_last_byte_to_ends(dut):
    datagrams = await begin(dut)
    for last in (0, 0, 1):
        seen = await datagrams.clk(rx_valid=1, rx_last=last, sender=FIRST)
        assert (seen["valid"], seen["ends"]) == (1, 0)
    seen = await datagrams.clk(rx_valid=1, sender=FIRST)
    assert (seen["valid"], seen["ends"], seen["rx_ready"]) == (0, 1, 0)
    seen = await datagrams.clk(rx_valid=1, sender=FIRST)
    assert (seen["valid"], seen["ends"]) == (1, 0)


@cocotb.test()
async def while_locked_every_other_address_and_port_is_foreign(dut):
    datagrams = await begin(dut)
    datagrams.settings["locked"] = 1
    assert not await datagrams.send(SECOND, accepted=0), "there is no master yet"
    assert not await datagrams.send(FIRST)
    for bit in range(48):
        assert await datagrams.send(FIRST ^ 1 << bit), f"bit {bit}"
    assert not await datagrams.send(FIRST)
    datagrams.settings["locked"] = 0
    assert not await datagrams.send(SECOND)
    datagrams.settings["locked"] = 1
    assert await datagrams.send(FIRST) and not await datagrams.send(SECOND)
    datagrams.settings["enable"] = 0
    await datagrams.clk()
    datagrams.settings["enable"] = 1
    assert not await datagrams.send(FIRST), "there is no master after the link was off"


@cocotb.test()
async def the_reply_goes_to_the_host_of_the_accepted_request(dut):
    datagrams = await begin(dut)
    await datagrams.send(FIRST)
    await datagrams.send(SECOND, accepted=0)
    assert (await datagrams.clk())["receiver"] == FIRST
    for _ in range(2):  # a datagram of another host begins while a request is accepted
        await datagrams.clk(rx_valid=1, rx_last=1, sender=SECOND)
        await datagrams.clk()
        await datagrams.clk(rx_valid=1, sender=FIRST, accepted=1)
        assert (await datagrams.clk())["receiver"] == SECOND


@cocotb.test()
async def the_length_is_that_of_the_reply(dut):
    datagrams = await begin(dut)
    for reads in (0, 1, layout.MOST_VALUES):
        datagrams.settings["reads"] = reads
        assert (await datagrams.clk())["length"] == 4 * reads + 28


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    datagrams = await begin(dut)
    for _ in range(4000):
        rare = lambda one_in: int(random.randrange(one_in) == 0)
        datagrams.settings |= dict(
            enable=int(random.randrange(30) > 0),
            locked=datagrams.settings["locked"] ^ rare(10),
            reads=random.randrange(layout.MOST_VALUES + 1),
        )
        await datagrams.clk(
            rx_valid=random.getrandbits(1),
            rx_last=rare(3),
            rx_error=rare(20),
            sender=random.choice([FIRST, SECOND, random.getrandbits(48)]),
            accepted=datagrams.model.host is not None and rare(5),
            rst=rare(200),
        )


def test_link_datagram():
    run("link_datagram", __file__)

# SPDX-License-Identifier: Apache-2.0
"""ps2_device: bytes and commands by hand, a host that cuts at every bit, bad commands, and random
lines against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, Timer

from tb import bench
from tb.peripheral.ps2_device import Ps2Device
from tb.peripheral.ps2_host import frame

CLK_HZ = 400_000
US = CLK_HZ / 1e6
BIT = round(80 * US)


class Side:
    """The design and its model on lines that a host may pull too, cycle by cycle."""

    def __init__(self, dut):
        self.dut, self.model = dut, Ps2Device(CLK_HZ)
        self.clock_low = self.data_low = 0
        self.now, self.edges, self.done, self.commands, self.aborted = 0, [], 0, [], 0

    async def begin(self):
        await bench.start(
            self.dut, clock=1, data=1, send_valid=0, send=0, send_damaged=0, received_ready=1
        )
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        await self.clk(n=4)
        return self

    async def clk(self, pull_clock=0, pull_data=0, send=None, damaged=0, ready=1, rst=0, n=1):
        """n cycles; edges gets (cycle, data) of each falling edge that the host does not make."""
        d, pins = self.dut, None
        d.send_valid.value, d.send.value, d.send_damaged.value = (
            send is not None,
            send or 0,
            damaged,
        )
        d.received_ready.value, d.rst.value = ready, rst
        for _ in range(n):
            clock, data = 1 - (self.clock_low | pull_clock), 1 - (self.data_low | pull_data)
            d.clock.value, d.data.value = clock, data
            await Timer(1, "ns")
            pins = [int(p.value) for p in (d.send_ready, d.received_valid)]
            pins += [int(p.value) if pins[1] else None for p in (d.received, d.received_damaged)]
            pins += [int(p.value) for p in (d.aborted, d.busy, d.clock_low, d.data_low)]
            want = self.model.pins(clock)
            assert tuple(pins) == want, f"clk {self.now}: {pins} where the model has {want}"
            if pins[1] and ready:
                self.commands.append((pins[2], pins[3]))
            self.done, self.aborted = self.done + pins[0], self.aborted + pins[4]
            self.model.step(clock, data, send, damaged, ready, rst)
            await FallingEdge(d.clk)
            self.now += 1
            if int(d.clock_low.value) > self.clock_low and not pull_clock:
                self.edges.append((self.now, 1 - (int(d.data_low.value) | pull_data)))
            self.clock_low, self.data_low = int(d.clock_low.value), int(d.data_low.value)
        return pins

    async def until_sent(self, byte, damaged=0):
        done = self.done
        while self.done == done:
            await self.clk(send=byte, damaged=damaged)
        await self.clk(n=BIT)

    async def command(self, bits, cut=None):
        """Send a command of the host: ten bits after the request. With `cut` the host pulls the
        clock after that many edges.
        """
        await self.clk(pull_clock=1, n=round(110 * US))
        await self.clk(pull_clock=1, pull_data=1, n=round(10 * US))
        self.edges.clear()
        low, bit = 1, 0
        for _ in range(round(1200 * US)):
            if len(self.edges) > bit:
                bit = len(self.edges)
                if bit == cut:
                    await self.clk(pull_clock=1, n=round(120 * US))
                    return None
                await self.clk(pull_data=low, n=round(10 * US))
                low = 1 - bits[bit - 1] if bit <= 10 else 0
            await self.clk(pull_data=low)
        return self.edges[-1][1] if len(self.edges) == 11 else None


@cocotb.test()
async def latency_is_20_us_with_released_lines_and_a_byte_takes_80_us_a_bit(dut):
    side = await Side(dut).begin()
    await side.clk(n=round(200 * US))
    begun = side.now
    await side.until_sent(0x1C)
    assert [bit for _, bit in side.edges] == [0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 1]
    assert {b - a for (a, _), (b, _) in zip(side.edges, side.edges[1:])} == {BIT}
    assert 20 * US <= side.edges[0][0] - begun <= 21 * US + 2


@cocotb.test()
async def every_byte_is_sent_whole_and_wrong_parity_on_demand(dut):
    side = await Side(dut).begin()
    for byte in [0x00, 0xFF, *random.sample(range(256), 20)]:
        damaged = random.randrange(2)
        side.edges.clear()
        await side.until_sent(byte, damaged)
        assert [bit for _, bit in side.edges] == frame(byte, damaged)
    assert side.aborted == 0


@cocotb.test()
async def a_host_that_cuts_after_any_bit_gets_the_byte_again_whole(dut):
    side = await Side(dut).begin()
    for cut in range(1, 11):
        for late in (0, BIT // 3, BIT // 2 + 2):
            side.edges.clear()
            while len(side.edges) < cut:
                await side.clk(send=0xA5)
            await side.clk(send=0xA5, n=late)
            done, aborted = side.done, side.aborted
            await side.clk(pull_clock=1, send=0xA5, n=round(120 * US))
            assert (
                side.done == done
                and side.aborted == aborted + 1
                and (side.clock_low, side.data_low) == (0, 0)
            ), (cut, late)
            side.edges.clear()
            await side.until_sent(0xA5)
            assert [bit for _, bit in side.edges] == frame(0xA5), (cut, late)
            await side.clk(n=round(100 * US))


@cocotb.test()
async def after_the_eleventh_edge_the_byte_is_sent_whatever_the_host_does(dut):
    side = await Side(dut).begin()
    while not side.done:
        await side.clk(send=0x33)
    side.edges.clear()
    await side.clk(pull_clock=1, n=round(200 * US))
    await side.clk(n=round(2000 * US))
    assert side.done == 1 and side.edges == [] and side.aborted == 0


@cocotb.test()
async def a_command_by_hand_is_acknowledged(dut):
    side = await Side(dut).begin()
    assert (
        await side.command([1, 0, 1, 1, 0, 1, 1, 1, 1, 1]) == 0
    )  # ED and its parity bit, stop; data low at the eleventh edge
    assert side.commands == [(0xED, 0)]
    assert await side.command(frame(0xF4, 1)[1:]) == 0
    assert side.commands.pop() == (0xF4, 1)
    assert await side.command([*frame(0xF4)[1:10], 0]) is not None
    assert side.commands.pop() == (0xF4, 1)  # no stop bit


@cocotb.test()
async def a_command_that_the_host_cuts_short_leaves_nothing(dut):
    side = await Side(dut).begin()
    for cut in range(1, 11):
        assert await side.command(frame(0xED)[1:], cut) is None
        await side.clk(n=round(200 * US))
    assert side.commands == [] and side.aborted == 10
    assert await side.command(frame(0xFF)[1:]) == 0
    assert side.commands == [(0xFF, 0)]


@cocotb.test()
async def a_command_goes_before_a_byte_and_waits_while_another_waits(dut):
    side = await Side(dut).begin()
    assert await side.command(frame(0xED)[1:]) == 0
    side.commands.clear()
    await side.clk(pull_clock=1, n=round(120 * US), send=0x12)
    side.edges.clear()
    await side.clk(pull_data=1, n=round(100 * US), send=0x12)
    assert side.edges and side.model.state == "receive"
    await side.clk(pull_clock=1, n=round(120 * US))
    while not side.model.valid:  # a byte that is not taken
        await side.clk(
            pull_data=int(not (side.model.state == "receive" and side.model.bit >= 9)), ready=0
        )
    side.edges.clear()
    await side.clk(pull_data=1, n=round(1000 * US), ready=0)
    assert len(side.edges) <= 1


@cocotb.test()
async def reset_lets_go_of_both_lines(dut):
    side = await Side(dut).begin()
    for wait in (30, 60, 100):
        while not side.clock_low:
            await side.clk(send=0)
        await side.clk(send=0, n=wait)
        await side.clk(send=0, rst=1)
        assert (side.clock_low, side.data_low) == (0, 0)
    side.edges.clear()
    await side.until_sent(0x77)
    assert [bit for _, bit in side.edges] == frame(0x77)


@cocotb.test()
async def any_lines_match_the_model(dut):
    side = await Side(dut).begin()
    for _ in range(150):
        more = dict(
            send=random.choice([None, random.getrandbits(8)]),
            damaged=random.randrange(2),
            ready=random.random() < 0.7,
        )
        kind = random.randrange(3)
        if kind == 0:
            await side.clk(n=random.randrange(500), **more)
        elif kind == 1:
            await side.command(
                frame(random.getrandbits(8), random.randrange(2))[1:],
                random.choice([None, random.randrange(1, 11)]),
            )
        else:
            await side.clk(
                random.randrange(2),
                random.randrange(2),
                n=random.randrange(1, 60),
                rst=random.random() < 0.1,
                **more,
            )


def test_ps2_device():
    bench.run("ps2_device", __file__, CLK_HZ=CLK_HZ)

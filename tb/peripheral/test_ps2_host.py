# SPDX-License-Identifier: Apache-2.0
"""ps2_host: bytes and commands by hand, damage, time-outs, holding, a recorded keyboard, and random
lines against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, Timer

from tb import bench
from tb.peripheral.ps2_host import Ps2Host, frame
from twin.recordings import KEYBOARD, TYPED, rows

CLK_HZ = 400_000
US = CLK_HZ / 1e6
BIT = round(80 * US)


class Side:
    """The design and its model, cycle by cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.bytes, self.results, self.pulls = (
            dut,
            Ps2Host(CLK_HZ),
            [],
            [],
            [],
        )

    async def begin(self):
        await bench.start(
            self.dut,
            hold=0,
            clock=1,
            data=1,
            command_valid=0,
            command=0,
            command_damaged=0,
            received_ready=1,
        )
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        await self.clk(n=4)
        return self

    async def clk(self, clock=1, data=1, hold=0, ready=1, command=None, damaged=0, rst=0, n=1):
        """Run n cycles with these inputs; returns the pins of the last one."""
        d = self.dut
        d.clock.value, d.data.value, d.hold.value, d.received_ready.value, d.rst.value = (
            clock,
            data,
            hold,
            ready,
            rst,
        )
        d.command_valid.value, d.command.value, d.command_damaged.value = (
            command is not None,
            command or 0,
            damaged,
        )
        for _ in range(n):
            await Timer(1, "ns")
            pins = [int(p.value) for p in (d.command_ready, d.received_valid)]
            pins += [int(p.value) if pins[1] else None for p in (d.received, d.received_damaged)]
            pins += [
                int(p.value) for p in (d.sent, d.unsent, d.held, d.busy, d.clock_low, d.data_low)
            ]
            want = self.model.pins(command is not None)
            assert tuple(pins) == want, f"{pins} where the model has {want}"
            if pins[1] and ready:
                self.bytes.append((pins[2], pins[3]))
            self.results += ["sent"] * pins[4] + ["unsent"] * pins[5]
            self.pulls.append((pins[8], pins[9]))
            self.model.step(clock, data, hold, ready, command, damaged, rst)
            await FallingEdge(d.clk)
        return pins

    async def type(self, bits, **more):
        for bit in bits:
            await self.clk(data=bit, n=BIT // 4, **more)
            await self.clk(data=bit, clock=0, n=BIT // 2, **more)
            await self.clk(data=bit, n=BIT - BIT // 4 - BIT // 2, **more)
        await self.clk(n=BIT, **more)

    async def obey(self, acknowledge=0):
        """Clock a command in as a keyboard does; returns the bits."""
        bits = []
        for bit in range(11):
            data = acknowledge if bit == 10 else 1 - self.pulls[-1][1]
            await self.clk(data=data, n=BIT // 2, clock=0)
            await self.clk(data=data if bit == 10 else 1 - self.pulls[-1][1], n=BIT // 2)
            bits.append(1 - self.pulls[-1][1])
        return bits


@cocotb.test()
async def one_byte_by_hand(dut):
    side = await Side(dut).begin()
    await side.type([0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 1])  # 1C: three ones, so the parity bit is 0
    assert side.bytes == [(0x1C, 0)]


@cocotb.test()
async def every_byte_passes_and_wrong_parity_is_reported(dut):
    side = await Side(dut).begin()
    for byte in [0x00, 0xFF, *random.sample(range(256), 40)]:
        await side.clk(n=round(120 * US))
        damaged = random.randrange(2)
        await side.type(frame(byte, damaged))
        assert side.bytes.pop() == (byte, damaged)
    await side.clk(n=round(120 * US))
    await side.type([*frame(0x1C)[:10], 0])
    assert side.bytes == [(0x1C, 1)]


@cocotb.test()
async def latency_is_2_and_a_byte_holds_the_keyboard_until_it_is_taken(dut):
    side = await Side(dut).begin()
    for bit in frame(0x5A)[:10]:
        await side.clk(data=bit, n=BIT // 2)
        await side.clk(data=bit, clock=0, n=BIT // 2)
    await side.clk(n=BIT // 2, ready=0)
    assert (await side.clk(clock=0, ready=0))[1] == 0
    assert (await side.clk(clock=0, ready=0))[1] == 1  # the edge was seen one cycle before
    for _ in range(3):
        assert (await side.clk(n=200, ready=0))[8] == 1
    assert side.bytes == []
    await side.clk()
    assert (await side.clk(n=4))[8] == 0 and side.bytes == [(0x5A, 0)]


@cocotb.test()
async def the_clock_is_pulled_for_100_us_at_least(dut):
    side = await Side(dut).begin()
    side.pulls.clear()
    await side.clk(hold=1)
    await side.clk(n=100)
    assert sum(clock for clock, _ in side.pulls) >= 100 * US
    assert (await side.clk(hold=1, n=100))[6] == 1  # held


@cocotb.test()
async def a_hold_for_longer_than_the_time_can_count_goes_on(dut):
    side = await Side(dut).begin()
    assert (await side.clk(hold=1, n=round(25_000 * US)))[6] == 1
    assert (await side.clk(n=4))[8] == 0
    await side.type(frame(0x1C))
    assert side.bytes == [(0x1C, 0)]


@cocotb.test()
async def a_command_by_hand(dut):
    side = await Side(dut).begin()
    while not (await side.clk(command=0xED))[0]:
        pass
    await side.clk(n=round(40 * US))
    assert side.pulls[-1] == (0, 1)  # data low, clock released
    assert await side.obey() == [
        1,
        0,
        1,
        1,
        0,
        1,
        1,
        1,
        1,
        1,
        1,
    ]  # ED: six ones, so the parity bit is 1; stop; acknowledge
    await side.clk(n=4)
    assert side.results == ["sent"]


@cocotb.test()
async def what_is_not_acknowledged_or_not_clocked_is_unsent(dut):
    side = await Side(dut).begin()
    while not (await side.clk(command=0xFF, damaged=1))[0]:
        pass
    await side.clk(n=round(40 * US))
    assert (await side.obey(acknowledge=1))[8] == 0  # wrong parity on purpose
    await side.clk(n=40)
    assert side.results == ["unsent"]
    while not (await side.clk(command=0xF4))[0]:
        pass
    await side.clk(n=round(14_900 * US))
    assert side.results == ["unsent"]
    await side.clk(n=round(300 * US))
    assert side.results == ["unsent"] * 2
    await side.type(frame(0xAA))
    assert side.bytes == [(0xAA, 0)]


@cocotb.test()
async def a_frame_that_stops_is_damaged_and_the_next_is_whole(dut):
    side = await Side(dut).begin()
    for length in range(1, 11):
        await side.type(frame(0x1C)[:length])
        await side.clk(n=round(500 * US))
        await side.type(frame(0x1B))
        await side.clk(n=round(200 * US))
        assert side.bytes == [(0, 1), (0x1B, 0)], length
        side.bytes.clear()
    await side.type([1, 1, 1])  # an edge with data high begins nothing
    await side.clk(n=round(500 * US))
    assert side.bytes == []


@cocotb.test()
async def reset_lets_go_of_both_lines(dut):
    side = await Side(dut).begin()
    while not (await side.clk(command=0xED))[0]:
        pass
    await side.clk(n=4)
    await side.clk(rst=1)
    assert (await side.clk())[8:] == [0, 0]
    await side.type(frame(0x1C)[:5])
    await side.clk(rst=1, clock=0)
    await side.clk(n=round(500 * US))
    assert side.bytes == []


@cocotb.test(skip=not KEYBOARD.exists())
async def a_recorded_keyboard_is_read(dut):
    """The keys a s d f g h of a real keyboard; its pauses are shortened to 1 ms, and the pull of
    its host after each byte is part of the recording.
    """
    side = await Side(dut).begin()
    changes = list(rows(KEYBOARD))
    for (at, clock, data), (end, _, _) in zip(
        changes, [*changes[1:], (changes[-1][0] + 24_000, 1, 1)]
    ):
        length = min((end - at) / 24, 1000)  # us
        if length > 2:  # what the deglitcher takes away
            await side.clk(clock, data, n=round(length * US))
    assert side.bytes == [(byte, 0) for byte in TYPED]


@cocotb.test()
async def any_lines_match_the_model(dut):
    side = await Side(dut).begin()
    for _ in range(60):
        kind = random.randrange(4)
        more = dict(
            hold=random.random() < 0.2,
            ready=random.random() < 0.8,
            command=random.choice([None, None, random.getrandbits(8)]),
        )
        if kind == 0:
            await side.type(
                frame(random.getrandbits(8), random.randrange(2))[: random.choice([11, 11, 5])],
                **more,
            )
        elif kind == 1:
            for _ in range(60):
                await side.clk(
                    random.getrandbits(1), random.getrandbits(1), n=random.randrange(1, 12), **more
                )
        elif kind == 2:
            await side.clk(n=random.randrange(600), **more)
        else:
            await side.obey(random.randrange(2))
            await side.clk(rst=random.randrange(2))


def test_ps2_host():
    if not KEYBOARD.exists():
        print(f"no recording {KEYBOARD}: its test is skipped")
    bench.run("ps2_host", __file__, CLK_HZ=CLK_HZ)


@pytest.mark.parametrize("hz", [399_999])
def test_too_slow_a_clk_is_refused(hz):
    made = bench.on_netlist() or bench.with_mutants()
    bench.needs(not made, "there is no netlist of what is refused")
    with pytest.raises((SystemExit, RuntimeError)):
        bench.run("ps2_host", __file__, CLK_HZ=hz)

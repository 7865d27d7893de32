# SPDX-License-Identifier: Apache-2.0
"""packet_player: the order of the accesses, the reply as the host reads it, lists of every end of
their range, captures before a request, and any timing of register bus and carrier against the model
in every cycle.
"""

import random
import struct

import cocotb
import pytest
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from moire.bus.link import Link, Spare
from moire.made import link_tables as layout
from tb.bench import needs, run, start
from tb.link.packet_player import NAMES, PacketPlayer
from tb.ports import Ports

SESSION = 0x123456
STROBES = ("list_put", "put", "start", "capture")
REST = ("list_at", "list_entry", "put_at", "word", "now", "refused", "expired")


class Player:
    """The design with its model beside it in every cycle, and registers behind it."""

    def __init__(self, dut):
        self.dut, self.model, self.cycles = dut, PacketPlayer(int(dut.CAPTURES.value)), 0
        self.ports = Ports(dut)
        self.levels = dict.fromkeys(
            (*STROBES, *REST, "bank", "writes", "reads", "enable", "hold"), 0
        )
        self.registers, self.accesses, self.reply = {}, [], bytearray()
        self.answers, self.word = [None, None], 0
        self.stall = 0.0  # share of cycles without ready, and without taken

    async def clk(self, rst=0, **strobes):
        """One cycle; returns whether the last byte of a reply was taken."""
        free = lambda: int(random.random() >= self.stall)
        answer = self.answers.pop(0)
        self.word = self.word if answer is None else answer
        inputs = self.levels | strobes | {"rst": rst, "ready": free(), "taken": free()}
        inputs |= {"rdata": self.word}
        self.ports.drive(inputs)
        await ReadOnly()
        want = dict(zip(NAMES, self.model.outputs(), strict=True))
        if self.cycles:
            self.ports.check(want, self.cycles)
        self.cycles += 1
        answer = None
        if want["select"]:
            at, value = want["address"], want["wdata"]
            self.accesses.append((at, value))
            if want["write"]:
                self.registers[at] = value
            answer = self.registers.get(at, at * 3)
        self.answers.append(answer)
        taken = want["valid"] and inputs["taken"]
        if taken:
            self.reply.append(want["data"])
        self.model.step(**inputs)
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        return bool(taken and want["last"])

    async def set_lists(self, writes, reads):
        """Store the lists of addresses while the link is off, then switch it on."""
        self.levels["enable"] = 0
        entries = max(len(writes), len(reads))
        for n in range(entries):
            pair = [at[n] if n < len(at) else 0 for at in (writes, reads)]
            await self.clk(list_put=1, list_at=n, list_entry=pair[0] | pair[1] << 16)
        self.levels |= {"enable": 1, "writes": len(writes), "reads": len(reads)}

    async def begin(self, packet):
        """Store a request in the bank, start it, and exchange the banks."""
        for n, (word,) in enumerate(struct.iter_unpack("<I", packet)):
            await self.clk(put=1, put_at=n, word=word)
        await self.clk(start=1)
        self.levels["bank"] ^= 1

    async def play(self, packet):
        """Play a request; returns the reply and the accesses."""
        self.accesses.clear()
        self.reply.clear()
        await self.begin(packet)
        while not await self.clk():
            assert self.model.busy
        await self.clk()
        assert not self.model.busy
        return bytes(self.reply), list(self.accesses)


async def begin(dut):
    player = Player(dut)
    await start(dut, **player.levels, ready=0, taken=0, rdata=0)
    await FallingEdge(dut.clk)
    await player.clk(rst=1)
    return player


@cocotb.test()
async def the_registers_are_written_then_read_in_order_then_the_spare_one(dut):
    player, host = await begin(dut), Link(SESSION, 3, 2)
    await player.set_lists([0x40C, 0x400, 0x008], [0x410, 0xC04])
    player.levels |= {"now": 77, "refused": 0x060504030201, "expired": 1}
    packet = host.request(0, [5, 6, 1], Spare(0x100))
    reply, accesses = await player.play(packet)
    assert accesses == [
        (0x40C, 5),
        (0x400, 6),
        (0x008, 1),
        (0x410, None),
        (0xC04, None),
        (0x100, None),
    ]
    got = host.reply(reply)
    assert got and (got.sequence, got.time, got.expired) == (1, 77, True)
    assert got.values == (0x410 * 3, 0xC04 * 3) and got.spare == 0x300
    assert list(got.refused.values()) == [1, 2, 3, 4, 5, 6]
    _, accesses = await player.play(host.request(0, [7, 8, 9], Spare(0x104, 0xFFFFFFFF)))
    assert accesses[-1] == (0x104, 0xFFFFFFFF)


@cocotb.test()
async def latency_is_1_then_7_for_a_register_2_for_a_word_of_the_head_6_for_a_sent_one(dut):
    player, host = await begin(dut), Link(SESSION, 4, 3)
    await player.set_lists([0x400] * 4, [0x404] * 3)
    await player.begin(host.request(0, [1] * 4))
    begun = player.cycles
    while player.model.busy:
        await player.clk()
    words = layout.REPLY_WORDS + 3 + layout.REPLY_END_WORDS + 1
    registers, phases = 4 + 3 + 1, 6
    assert player.cycles - begun == 7 * registers + 2 * layout.REPLY_WORDS + 6 * words + phases


@cocotb.test()
async def lists_may_be_empty_or_as_long_as_a_packet(dut):
    player, most = await begin(dut), layout.MOST_VALUES
    for writes, reads in ((0, 0), (most, 0), (0, most)):
        host = Link(SESSION, writes, reads)
        at = [random.randrange(0, 0x2000, 4) for _ in range(most)]
        await player.set_lists(at[:writes], at[:reads])
        values = [random.getrandbits(32) for _ in range(writes)]
        reply, accesses = await player.play(host.request(0, values))
        assert accesses[:writes] == list(zip(at[:writes], values, strict=True))
        assert [at for at, _ in accesses[writes:]] == [*at[:reads], 0]
        assert host.reply(reply)


@cocotb.test()
async def a_list_changes_only_while_the_link_is_off(dut):
    player, host = await begin(dut), Link(SESSION, 1, 1)
    await player.set_lists([0x400], [0x404])
    await player.clk(list_put=1, list_at=0, list_entry=0x0BAD0BAC)
    _, accesses = await player.play(host.request(0, [3]))
    assert [at for at, _ in accesses] == [0x400, 0x404, 0]


async def capturing(dut):
    """A player with two registers in each list, and its host; replies carry captures."""
    needs(int(dut.CAPTURES.value), "a player without captures")
    player, host = await begin(dut), Link(SESSION, 2, 2)
    await player.set_lists([0x40C, 0x400], [0x410, 0xC04])
    player.levels["hold"] = 1
    return player, host


async def capture(player, now):
    """A whole capture at a time."""
    player.levels["now"] = now
    await player.clk(capture=1)
    while not player.model.idle:
        await player.clk()


@cocotb.test()
async def a_reply_carries_the_last_capture_once_and_the_time_of_its_request(dut):
    player, host = await capturing(dut)
    player.registers |= {0x410: 1, 0xC04: 2}
    await capture(player, 1000)
    player.registers |= {0x410: 3, 0xC04: 4}
    await capture(player, 2000)
    player.registers |= {0x410: 5, 0xC04: 6, 0x500: 7}
    player.levels["now"] = 2500
    reply, accesses = await player.play(host.request(0, [8, 9], Spare(0x500)))
    assert accesses == [(0x40C, 8), (0x400, 9), (0x500, None)]
    got = host.reply(reply)
    assert (got.values, got.time, got.spare) == ((3, 4), 2500, 7)
    assert int(dut.read_at.value) == 2000
    player.levels["now"] = 3500
    reply, accesses = await player.play(host.request(0, [10, 11], Spare(0x500)))
    reads = [(0x410, None), (0xC04, None), (0x500, None)]
    assert accesses == [(0x40C, 10), (0x400, 11), *reads]
    assert host.reply(reply).values == (5, 6) and int(dut.read_at.value) == 3500


@cocotb.test()
async def without_hold_the_registers_are_read_with_the_request(dut):
    player, host = await capturing(dut)
    player.registers |= {0x410: 1, 0xC04: 2}
    await capture(player, 1000)
    player.registers |= {0x410: 3, 0xC04: 4}
    await player.clk(hold=0)
    player.levels["now"] = 1500
    for _ in range(2):
        reply, _ = await player.play(host.request(0, [8, 9]))
        assert host.reply(reply).values == (3, 4) and int(dut.read_at.value) == 1500


@cocotb.test()
async def a_request_waits_for_the_end_of_a_capture(dut):
    player, host = await capturing(dut)
    for wait in (0, 1, 7, 14, 15):
        packet = host.request(0, [8, 9])
        for n, (word,) in enumerate(struct.iter_unpack("<I", packet)):
            await player.clk(put=1, put_at=n, word=word)
        player.registers[0x410] = wait
        player.accesses.clear()
        player.reply.clear()
        await player.clk(capture=1, start=int(wait == 0))
        player.levels["bank"] ^= int(wait == 0)
        for n in range(1, wait + 1):
            assert player.model.capturing and not player.model.busy
            await player.clk(start=int(n == wait))
        player.levels["bank"] ^= int(wait > 0)
        assert player.model.busy
        while not await player.clk():
            assert player.model.busy
        await player.clk()
        assert [at for at, _ in player.accesses] == [0x410, 0xC04, 0x40C, 0x400, 0]
        assert host.reply(bytes(player.reply)).values[0] == wait


@cocotb.test()
async def a_capture_waits_for_the_end_of_a_reply_unless_hold_falls(dut):
    player, host = await capturing(dut)
    for hold in (1, 0):
        await player.begin(host.request(0, [8, 9]))
        await player.clk()
        await player.clk(capture=1)
        await player.clk(hold=hold)
        while player.model.busy:
            await player.clk()
        await player.clk()
        assert player.model.capturing == hold
        while not player.model.idle:
            await player.clk()


@cocotb.test()
async def latency_is_1_from_capture_to_the_first_step_of_the_reading(dut):
    player, _ = await capturing(dut)
    begun = player.cycles
    await player.clk(capture=1)
    assert int(dut.capturing.value)
    while not player.model.idle:
        await player.clk()
    assert player.cycles - begun == 1 + 7 * 2 + 1


@cocotb.test()
async def captures_are_ignored_by_a_player_without_them(dut):
    needs(not int(dut.CAPTURES.value), "a player with captures")
    player, host = await begin(dut), Link(SESSION, 0, 1)
    await player.set_lists([], [0x410])
    player.levels["hold"] = 1
    await player.clk(capture=1)
    assert player.model.idle and not player.accesses
    player.registers[0x410] = 5
    reply, _ = await player.play(host.request(0, []))
    assert host.reply(reply).values == (5,) and int(dut.read_at.value) == 0


@cocotb.test()
async def any_timing_and_a_reset_match_the_model(dut):
    player = await begin(dut)
    for n in range(10):
        player.stall = random.choice([0, 0.3, 0.8])
        player.levels["hold"] = 0
        while not player.model.idle:
            await player.clk()
        writes, reads = random.randrange(6), random.randrange(6)
        await player.set_lists(
            *([random.randrange(0, 0x2000, 4) for _ in range(size)] for size in (writes, reads))
        )
        host = Link(SESSION, writes, reads)
        player.levels["hold"] = random.getrandbits(1)
        player.levels["now"] = random.getrandbits(32)
        for _ in range(random.choice([0, 80])):
            await player.clk(capture=random.random() < 0.05, hold=random.random() < 0.9)
        values = [random.getrandbits(32) for _ in range(writes)]
        spare = Spare(random.randrange(0, 0x2000, 4), random.choice([None, n]))
        packet = host.request(0, values, spare)
        if n % 5 == 4:
            await player.begin(packet)
            for _ in range(random.randrange(40)):
                await player.clk(capture=random.random() < 0.05)
            await player.clk(rst=1)
            player.levels["bank"] = 0
        reply, _ = await player.play(packet)
        assert host.reply(reply).time == player.levels["now"]


@pytest.mark.parametrize("captures", [0, 1])
def test_packet_player(captures):
    run("packet_player", __file__, CAPTURES=captures)

# SPDX-License-Identifier: Apache-2.0
"""packet_player: the order of the accesses, the reply as the host reads it, lists of every end of
their range, and any timing of register bus and carrier against the model in every cycle.
"""

import random
import struct

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from moire.bus.link import Link, Spare
from moire.made import link_tables as layout
from tb.bench import run, start
from tb.link.packet_player import NAMES, PacketPlayer

SESSION = 0x123456
STROBES = ("list_put", "put", "start")
REST = ("list_at", "list_entry", "put_at", "word", "now", "refused", "expired")


class Player:
    """The design with its model beside it in every cycle, and registers behind it."""

    def __init__(self, dut):
        self.dut, self.model, self.cycles = dut, PacketPlayer(), 0
        self.levels = dict.fromkeys((*STROBES, *REST, "bank", "writes", "reads", "enable"), 0)
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
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await ReadOnly()
        want = dict(zip(NAMES, self.model.outputs(), strict=True))
        for name, level in want.items():
            if level is not None and self.cycles:
                got = int(getattr(self.dut, name).value)
                assert got == level, f"cycle {self.cycles}: {name} is {got:#x}, not {level:#x}"
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


@cocotb.test()
async def any_timing_and_a_reset_match_the_model(dut):
    player = await begin(dut)
    for n in range(10):
        player.stall = random.choice([0, 0.3, 0.8])
        writes, reads = random.randrange(6), random.randrange(6)
        await player.set_lists(
            *([random.randrange(0, 0x2000, 4) for _ in range(size)] for size in (writes, reads))
        )
        host = Link(SESSION, writes, reads)
        player.levels["now"] = random.getrandbits(32)
        values = [random.getrandbits(32) for _ in range(writes)]
        spare = Spare(random.randrange(0, 0x2000, 4), random.choice([None, n]))
        packet = host.request(0, values, spare)
        if n % 5 == 4:
            await player.begin(packet)
            for _ in range(random.randrange(40)):
                await player.clk()
            await player.clk(rst=1)
            player.levels["bank"] = 0
        reply, _ = await player.play(packet)
        assert host.reply(reply).time == player.levels["now"]


def test_packet_player():
    run("packet_player", __file__)

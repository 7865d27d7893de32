# SPDX-License-Identifier: Apache-2.0
"""process_link: requests of the host's codec in, accesses and replies out, with a request arriving
while the last one is answered, the watchdog, and captures before requests that are expected. Its
blocks' models run beside it in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from moire.bus.link import Link, Spare
from tb.bench import needs, run, start
from tb.interlock.heartbeat_watchdog import HeartbeatWatchdog
from tb.link.link_pll import FULL, LinkPll
from tb.link.packet_player import PacketPlayer
from tb.link.packet_receiver import PacketReceiver
from tb.ports import Ports

SESSION = 0x00BEEF
CLK_HZ = 1_000_000
NAMES = ("busy", "capturing", "request", "select", "write", "address", "wdata")
NAMES += ("tx_valid", "tx_data", "tx_last", "read_at")
PERIOD, LEAD = 2048, 300  # cycles
INPUTS = {
    "enable": 0,
    "session": SESSION,
    "writes": 2,
    "reads": 2,
    "time_window": 1000,
    "watchdog_ms": 2,
    "pll_period": PERIOD,
    "capture_lead": LEAD,
    "list_put": 0,
    "list_at": 0,
    "list_entry": 0,
    "rx_valid": 0,
    "rx_data": 0,
    "rx_ends": 0,
    "rx_broken": 0,
    "rx_foreign": 0,
    "tx_taken": 1,
    "ready": 1,
    "rdata": 0,
    "now": 0,
}
LIST = (0x410_0400, 0x414_0404)  # reads 410 and 414, writes 400 and 404


class Node:
    """The design with the models of its blocks beside it, and registers behind it."""

    def __init__(self, dut):
        self.dut, self.levels, self.cycles = dut, dict(INPUTS), 0
        self.ports = Ports(dut)
        self.has_pll, self.pll = int(dut.PLL.value), LinkPll()
        self.receiver, self.player = PacketReceiver(), PacketPlayer(self.has_pll)
        self.watchdog, self.expired = HeartbeatWatchdog(CLK_HZ), 0
        self.registers, self.answers, self.replies = {}, [0, 0], [bytearray()]

    async def clk(self, rst=0, **strobes):
        now = self.levels["now"] = (self.levels["now"] + 1) % 2**32
        inputs = self.levels | strobes | {"rst": rst, "rdata": self.answers.pop(0)}
        self.ports.drive(inputs)
        await ReadOnly()
        enable, session, writes = (inputs[name] for name in ("enable", "session", "writes"))
        traffic = {"enable": enable, "valid": inputs["rx_valid"], "data": inputs["rx_data"]}
        accepted, bank, refused, put, put_at, word = self.receiver.outputs(**traffic)
        want = dict(zip(NAMES, self.player.outputs(), strict=True))
        locked, phase_error, capture = self.pll.outputs() if self.has_pll else (0, 0, 0)
        others = {"refused": refused, "expired": self.expired, "accepted": accepted}
        others |= {"locked": locked, "phase_error": phase_error}
        if self.cycles:
            self.ports.check(want | others, self.cycles)
        self.cycles += 1
        answer = self.answers[-1]
        if want["select"]:
            if want["write"]:
                self.registers[want["address"]] = want["wdata"]
            answer = self.registers.get(want["address"], want["address"] + 1)
        self.answers.append(answer)
        if want["tx_valid"] and inputs["tx_taken"]:
            self.replies[-1].append(want["tx_data"])
            if want["tx_last"]:
                self.replies.append(bytearray())
        self.receiver.step(
            **traffic,
            session=session,
            writes=writes,
            time_window=inputs["time_window"],
            now=now,
            ends=inputs["rx_ends"],
            broken=inputs["rx_broken"],
            foreign=inputs["rx_foreign"],
            busy=want["busy"],
            rst=rst,
        )
        self.player.step(
            **{name: inputs[name] for name in ("list_put", "list_at", "list_entry", "ready")},
            **{name: inputs[name] for name in ("reads", "rdata", "enable", "writes")},
            taken=inputs["tx_taken"],
            put=put,
            put_at=put_at,
            word=word,
            bank=bank,
            start=accepted,
            refused=refused,
            expired=self.expired,
            now=now,
            capture=capture,
            hold=locked,
            rst=rst,
        )
        self.pll.step(enable, inputs["pll_period"], inputs["capture_lead"], accepted, rst)
        self.expired = self.watchdog.clk(rst, inputs["watchdog_ms"], accepted, enable)
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)

    async def send(self, packet):
        for byte in packet:
            await self.clk(rx_valid=1, rx_data=byte)
        await self.clk(rx_ends=1)
        await self.clk()

    async def answered(self):
        """Run until the reply is complete; returns it."""
        assert self.player.busy or self.receiver.verdict == "accepted"
        while len(self.replies) < 2:
            await self.clk()
        await self.clk()
        return bytes(self.replies.pop(0))


async def begin(dut, writes=2, reads=2):
    """The link on, and its host; after the lists have been put, their inputs may have any level."""
    await start(dut, **INPUTS)
    await FallingEdge(dut.clk)
    node = Node(dut)
    await node.clk(rst=1)
    node.levels |= {"writes": writes, "reads": reads}
    for n, entry in enumerate(LIST):
        await node.clk(list_put=1, list_at=n, list_entry=entry)
    for n in range(len(LIST)):
        await node.clk(list_at=n, list_entry=0xBAD_0BAD)
    node.levels["enable"] = 1
    return node, Link(SESSION, writes, reads)


@cocotb.test()
async def a_request_is_played_and_answered_and_a_repeated_one_is_not(dut):
    node, host = await begin(dut)
    packet = host.request(node.levels["now"] + 40, [11, 22], Spare(0x500, 33))
    await node.send(packet)
    reply = host.reply(await node.answered())
    assert node.registers == {0x400: 11, 0x404: 22, 0x500: 33}
    assert reply and reply.values == (0x411, 0x415)
    node.registers.clear()
    await node.send(packet)
    for _ in range(50):
        await node.clk()
    assert not node.registers and len(node.replies) == 1
    await node.send(host.request(node.levels["now"], [1, 2]))
    assert host.reply(await node.answered()).refused["replayed"] == 1


@cocotb.test()
async def a_request_that_the_carrier_calls_foreign_changes_nothing(dut):
    node, host = await begin(dut)
    for byte in host.request(node.levels["now"] + 40, [11, 22]):
        await node.clk(rx_valid=1, rx_data=byte)
    await node.clk(rx_ends=1, rx_foreign=1)
    for _ in range(50):
        await node.clk()
    assert not node.registers and len(node.replies) == 1
    assert node.receiver.counts["foreign"] == 1


@cocotb.test()
async def a_request_that_arrives_during_an_answer_is_busy_and_changes_nothing(dut):
    node, host = await begin(dut)
    await node.send(host.request(node.levels["now"], [11, 22]))
    node.levels["tx_taken"] = 0
    second = Link(SESSION, 2, 2)
    second.sequence = host.sequence
    await node.send(second.request(node.levels["now"], [0xBAD, 0xBAD]))
    node.levels["tx_taken"] = 1
    assert host.reply(await node.answered()).values == (0x411, 0x415)
    assert node.registers == {0x400: 11, 0x404: 22}
    assert node.receiver.counts["busy"] == 1


@cocotb.test()
async def the_watchdog_expires_after_its_time_and_a_bad_packet_does_not_kick_it(dut):
    node, host = await begin(dut)
    await node.send(host.request(node.levels["now"], [1, 2]))
    await node.answered()
    for _ in range(1000):
        await node.clk()
    await node.send(bytes(range(32)))
    for _ in range(1000):
        await node.clk()
    assert node.expired
    await node.send(host.request(node.levels["now"], [1, 2]))
    assert not node.expired
    await node.answered()


@cocotb.test()
async def both_lists_have_lengths_of_their_own_and_stay_while_the_link_is_on(dut):
    node, host = await begin(dut, writes=1)
    await node.clk(list_put=1, list_at=0, list_entry=0xBAD_0BAD)
    await node.send(host.request(node.levels["now"], [11]))
    assert host.reply(await node.answered()).values == (0x411, 0x415)
    assert node.registers == {0x400: 11}


@cocotb.test()
async def a_packet_is_refused_if_the_link_is_off_a_byte_was_lost_or_its_time_is_wrong(dut):
    node, host = await begin(dut)
    node.levels["enable"] = 0
    await node.send(host.request(node.levels["now"], [1, 2]))
    node.levels["enable"] = 1
    await node.clk(rx_broken=1)
    await node.send(host.request(node.levels["now"], [1, 2]))
    for late in (2000, -2000):
        await node.send(host.request(node.levels["now"] - late, [1, 2]))
    assert not node.registers
    node.levels["time_window"] = 0
    await node.send(host.request(node.levels["now"] + 10**6, [11, 22]))
    reply = host.reply(await node.answered())
    assert node.registers == {0x400: 11, 0x404: 22}
    counts = {cause: count for cause, count in reply.refused.items() if count}
    assert counts == {"foreign": 1, "damaged": 1, "out_of_time": 2}


@cocotb.test()
async def the_reply_says_that_the_watchdog_has_expired_while_the_registers_were_busy(dut):
    node, host = await begin(dut)
    await node.send(host.request(node.levels["now"], [1, 2]))
    node.levels["ready"] = 0
    for _ in range(2100):
        await node.clk()
    assert node.expired
    node.levels["ready"] = 1
    assert host.reply(await node.answered()).expired
    await node.clk(rst=1)
    await node.clk()
    assert not node.expired


@cocotb.test()
async def the_watchdog_waits_while_the_link_is_off(dut):
    node, _ = await begin(dut)
    node.levels["enable"] = 0
    for _ in range(2100):
        await node.clk()
    assert not node.expired


@cocotb.test()
async def any_bytes_match_the_models(dut):
    node, host = await begin(dut)
    for _ in range(40):
        packet = bytearray(host.request(node.levels["now"], [random.getrandbits(32)] * 2))
        if random.getrandbits(1):
            packet[random.randrange(len(packet))] ^= random.getrandbits(8)
        await node.send(packet)
        for _ in range(random.choice([0, 0, 150])):
            await node.clk(tx_taken=random.getrandbits(1))
        if random.random() < 0.05:
            await node.clk(rst=1)


@cocotb.test()
async def replies_carry_what_was_captured_before_the_request_once_the_pll_is_locked(dut):
    needs(int(dut.PLL.value), "a link without a PLL")
    node, host = await begin(dut)
    node.levels["time_window"] = 0
    for n in range(FULL + 6):
        begun = node.levels["now"]
        while node.levels["now"] < begun + 1000:
            await node.clk()
        node.registers[0x410] = 1  # what a capture finds
        while node.levels["now"] < begun + 1300:
            await node.clk()
        node.registers[0x410] = 2  # what the request finds
        await node.send(host.request(0, [1, 2]))
        arrived = node.levels["now"]
        reply = host.reply(await node.answered())
        captured = n > FULL
        assert reply.values[0] == (1 if captured else 2)
        assert 0 < reply.time - arrived < 60
        read = node.player.read_at - arrived
        assert read == (1 - LEAD if captured else reply.time - arrived + 6)
        while node.levels["now"] < begun + PERIOD:
            await node.clk()
    node.levels["enable"] = 0
    await node.clk()
    assert not int(dut.locked.value)


@pytest.mark.parametrize("pll", [0, 1])
def test_process_link(pll):
    run("process_link", __file__, CLK_HZ=CLK_HZ, PLL=pll)

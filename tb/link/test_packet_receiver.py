# SPDX-License-Identifier: Apache-2.0
"""packet_receiver: each cause of a refusal, every bit of a request flipped, the ends of each range,
and any traffic against the model in every cycle.
"""

import random
import struct

import cocotb
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge

from moire.bus.link import Link, sealed
from moire.made import link_tables as layout
from tb.bench import run, start
from tb.link.packet_receiver import NAMES, PacketReceiver
from tb.ports import Ports

SESSION = 0xABCDEF
NAMED = ("accepted", "bank", "refused", "put", "put_at", "word")


class Receiver:
    """The design with its model beside it in every cycle."""

    def __init__(self, dut):
        self.dut, self.model, self.cycles = dut, PacketReceiver(), 0
        self.ports = Ports(dut)
        self.settings = {"enable": 1, "session": SESSION, "writes": 2, "time_window": 0}
        self.now = self.busy = self.put = 0

    async def clk(self, valid=0, data=0, ends=0, broken=0, foreign=0, rst=0):
        """One cycle; returns accepted."""
        inputs = {"valid": valid, "data": data, "ends": ends, "broken": broken, "rst": rst}
        inputs |= self.settings | {"now": self.now, "busy": self.busy, "foreign": foreign}
        self.ports.drive(inputs)
        await ReadOnly()
        want = self.model.outputs(**inputs)
        self.ports.check(dict(zip(NAMED, want, strict=True)), self.cycles)
        self.put = self.ports["put"]
        self.model.step(**inputs)
        self.cycles += 1
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        return want[0]

    async def send(self, packet, gap=0, broken_at=None, foreign=0):
        """Send a packet; returns what became of it: accepted, or a cause."""
        before = dict(self.model.counts)
        for n, byte in enumerate(packet):
            await self.clk(1, byte, broken=n == broken_at)
            for _ in range(gap and random.randrange(gap)):
                await self.clk()
        await self.clk(ends=1, foreign=foreign)
        accepted = await self.clk()
        assert not await self.clk()
        more = [name for name in NAMES if self.model.counts[name] != before[name]]
        assert len(more) + accepted == bool(packet)
        return "accepted" if accepted else more[0] if more else None


async def begin(dut):
    idle = ("enable", "session", "writes", "time_window", "now", "valid", "data", "ends")
    await start(dut, **dict.fromkeys((*idle, "broken", "foreign", "busy"), 0))
    await FallingEdge(dut.clk)
    receiver = Receiver(dut)
    await receiver.clk(rst=1)
    return receiver


def link(sequence=0, writes=2):
    made = Link(SESSION, writes, 1)
    made.sequence = sequence
    return made


@cocotb.test()
async def a_request_is_accepted_once_and_each_cause_is_counted_alone(dut):
    receiver, host = await begin(dut), link()
    packet = host.request(0, [1, 2])
    assert await receiver.send(packet) == "accepted"
    assert await receiver.send(packet) == "replayed"
    assert await receiver.send(host.request(0, [1, 2])) == "accepted"
    assert await receiver.send(packet) == "replayed"
    assert await receiver.send(packet[:-1]) == "damaged"
    assert await receiver.send(host.request(0, [1, 2]), broken_at=9) == "damaged"
    other = Link(SESSION ^ 1, 2, 1)
    assert await receiver.send(other.request(0, [1, 2])) == "foreign"
    assert await receiver.send(host.request(0, [1, 2]), foreign=1) == "foreign"
    reply = sealed([layout.KIND_REPLY | SESSION << 8, 9, 0, 1, 2, 0, 0])
    assert await receiver.send(reply) == "foreign"
    for writes in (1, 3, layout.MOST_VALUES):
        longer = link(9, writes).request(0, [0] * writes)
        assert await receiver.send(longer) == "wrong_length"
    assert await receiver.send(bytes(1100)) == "damaged"
    assert await receiver.send(b"") is None
    receiver.busy = 1
    packet = host.request(0, [1, 2])
    assert await receiver.send(packet) == "busy"
    receiver.busy = 0
    assert await receiver.send(packet) == "accepted", "a refused packet changes no sequence"


@cocotb.test()
async def latency_is_1_from_ends_to_accepted_and_0_from_each_fourth_byte_to_put(dut):
    receiver = await begin(dut)
    for n, byte in enumerate(link().request(0, [1, 2])):
        assert not await receiver.clk(1, byte)
        assert receiver.put == (n % 4 == 3)
    assert not await receiver.clk(ends=1)
    assert await receiver.clk()


@cocotb.test()
async def no_flip_of_a_bit_and_no_shorter_packet_is_accepted(dut):
    receiver, host = await begin(dut), link()
    packet = host.request(0, [0x12345678, 0])
    for bit in range(8 * len(packet)):
        bent = bytearray(packet)
        bent[bit // 8] ^= 1 << bit % 8
        assert await receiver.send(bent) == "damaged", f"bit {bit}"
    for length in range(1, len(packet)):
        assert await receiver.send(packet[:length]) == "damaged", f"{length} bytes"
    assert await receiver.send(packet + b"\0") == "damaged"
    assert await receiver.send(packet) == "accepted"


@cocotb.test()
async def the_sequence_may_advance_by_less_than_2_31_and_wraps(dut):
    receiver, last = await begin(dut), 0
    for advance, result in (
        (2**31, "replayed"),
        (0, "replayed"),
        (2**32 - 1, "replayed"),
        (2**31 - 1, "accepted"),
        (2**31 - 1, "accepted"),
        (3, "accepted"),
    ):
        host = link((last + advance - 1) % 2**32)
        assert await receiver.send(host.request(0, [1, 2])) == result, f"advance {advance}"
        last = host.sequence if result == "accepted" else last


@cocotb.test()
async def the_time_may_differ_by_the_window_and_wraps(dut):
    receiver, host = await begin(dut), link()
    for window in (1, 1000, 2**24 - 1):
        receiver.settings["time_window"] = window
        for now in (0, 5, 2**31, 2**32 - 1):
            receiver.now = now
            for off, result in (
                (0, "accepted"),
                (window, "accepted"),
                (-window, "accepted"),
                (window + 1, "out_of_time"),
                (-window - 1, "out_of_time"),
                (2**31, "out_of_time"),
            ):
                packet = host.request(now + off, [1, 2])
                assert await receiver.send(packet) == result, f"{window} {now} {off}"


@cocotb.test()
async def a_packet_across_a_change_of_enable_is_foreign(dut):
    receiver, host = await begin(dut), link()
    assert await receiver.send(host.request(0, [1, 2])) == "accepted"
    packet = host.request(0, [1, 2])
    for cut in (1, 4, 12, len(packet) - 1):
        receiver.settings["enable"] = 0
        for byte in packet[:cut]:
            await receiver.clk(1, byte)
        receiver.settings["enable"] = 1
        assert await receiver.send(packet[cut:]) == "foreign", f"cut at {cut}"
    receiver.settings["enable"] = 0
    assert await receiver.send(packet) == "foreign"


@cocotb.test()
async def the_longest_request_fills_its_bank(dut):
    receiver, writes = await begin(dut), layout.MOST_VALUES - 1
    receiver.settings["writes"] = writes
    values = [random.getrandbits(32) for _ in range(writes)]
    assert await receiver.send(link(0, writes).request(0, values)) == "accepted"


@cocotb.test()
async def the_limit_of_writes_is_122(dut):
    receiver, writes = await begin(dut), 122
    receiver.settings["writes"] = writes
    request = [layout.KIND_REQUEST | SESSION << 8, 1, *[0] * (layout.FRAME_WORDS - 3 + writes)]
    assert await receiver.send(sealed(request)) == "accepted"
    assert await receiver.send(sealed([request[0], 2, *request[3:]])) == "wrong_length"


@cocotb.test()
async def every_bit_of_kind_and_session_counts(dut):
    receiver = await begin(dut)
    packet = link().request(0, [1, 2])
    identity, *others = struct.unpack(f"<{len(packet) // 4}I", packet)
    for bit in range(32):
        other = sealed([identity ^ 1 << bit, *others[:-1]])
        assert await receiver.send(other) == "foreign", f"bit {bit}"
    assert await receiver.send(packet) == "accepted"


@cocotb.test()
async def the_count_of_each_cause_wraps(dut):
    receiver = await begin(dut)
    receiver.settings["time_window"] = 100
    packet = link().request(0, [1, 2])
    assert await receiver.send(packet) == "accepted"
    later = link(1)
    provoked = {
        "damaged": lambda: receiver.send(b"0"),
        "foreign": lambda: receiver.send(packet, foreign=1),
        "wrong_length": lambda: receiver.send(link(1, 1).request(0, [0])),
        "replayed": lambda: receiver.send(packet),
        "out_of_time": lambda: receiver.send(later.request(101, [1, 2])),
        "busy": lambda: receiver.send(later.request(0, [1, 2])),
    }
    assert tuple(provoked) == tuple(NAMES)
    for cause, refusal in provoked.items():
        receiver.busy = int(cause == "busy")
        for _ in range(257):
            assert await refusal() == cause
        assert receiver.model.counts[cause] == 1


@cocotb.test()
async def any_traffic_matches_the_model(dut):
    receiver, host = await begin(dut), link()
    for _ in range(120):
        receiver.now, receiver.busy = random.getrandbits(32), int(random.random() < 0.1)
        if random.random() < 0.1:
            enable, receiver.settings["enable"] = receiver.settings["enable"], 0
            await receiver.clk()
            receiver.settings["writes"] = random.choice([0, 1, 2, 5])
            receiver.settings["time_window"] = random.choice([0, 0, 100])
            await receiver.clk()
            receiver.settings["enable"] = int(enable or random.getrandbits(1))
        writes = receiver.settings["writes"] if random.random() < 0.9 else 3
        host = link(random.choice([host.sequence, host.sequence, random.getrandbits(32)]), writes)
        time = receiver.now + random.choice([0, 100, -100, 101])
        packet = bytearray(host.request(time, [random.getrandbits(32)] * writes))
        if random.random() < 0.2:
            packet[random.randrange(len(packet))] ^= 1 << random.randrange(8)
        await receiver.send(
            packet,
            random.choice([0, 3]),
            random.choice([None, None, 2, 300]),
            random.choice([0, 0, 0, 1]),
        )
        if random.random() < 0.05:
            await receiver.clk(1, 0x51, rst=1)


def test_packet_receiver():
    run("packet_receiver", __file__)

# SPDX-License-Identifier: Apache-2.0
"""ps2_pass between a keyboard and a host with every disturbance that the interface permits: typing,
cuts, commands, damage, injections. It equals the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge

from tb import bench
from tb.peripheral.ps2_lines import Host, Keyboard, Party
from tb.peripheral.ps2_pass import Ps2Pass
from tools import sigrok
from twin.recordings import KEYBOARD, TYPED, rows

CLK_HZ = 400_000
MS = CLK_HZ // 1000
START = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]  # S4: left Ctrl + W, the start of a cut


class Wires:
    """Keyboard, design and host on their lines, and the model beside the design."""

    def __init__(self, dut, keyboard=None, host=None):
        self.dut, self.model = dut, Ps2Pass(CLK_HZ)
        self.keyboard, self.host = keyboard or Keyboard(CLK_HZ), host or Host(CLK_HZ)
        self.idle_ms, self.inject, self.pulls = 20, [], (0, 0, 0, 0)
        self.typed = 0
        self.samples, self.edges, self.lines = (
            bytearray(),
            {"keyboard": [], "host": []},
            (1, 1, 1, 1),
        )

    async def begin(self):
        names = "keyboard_clock", "keyboard_data", "host_clock", "host_data"
        await bench.start(
            self.dut,
            idle_ms=self.idle_ms,
            inject_valid=0,
            inject=0,
            inject_last=0,
            **dict.fromkeys(names, 1),
        )
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        await self.run(10)
        return self

    async def run(self, clks=None, until=None):
        d, k, h = self.dut, self.keyboard, self.host
        last = None
        for _ in range(clks or 4000 * MS):
            if until and until():
                return
            lines = (
                1 - (self.pulls[0] | k.clock_low),
                1 - (self.pulls[1] | k.data_low),
                1 - (self.pulls[2] | h.clock_low),
                1 - (self.pulls[3] | h.data_low),
            )
            inject = (self.inject[0], int(len(self.inject) == 1)) if self.inject else None
            if (lines, inject) != last:
                (
                    d.keyboard_clock.value,
                    d.keyboard_data.value,
                    d.host_clock.value,
                    d.host_data.value,
                ) = lines
                d.inject_valid.value, d.inject.value, d.inject_last.value = (
                    inject is not None,
                    *(inject or (0, 0)),
                )
                last = lines, inject
            k.step(*lines[:2])
            h.step(*lines[2:])
            taken = (
                self.model.arbiter.wires(self.model.inputs(self.idle_ms, inject))[5]
                if inject
                else 0
            )
            want = self.model.step(lines, self.idle_ms, inject)
            await FallingEdge(d.clk)
            pulls = tuple(
                int(p.value)
                for p in (
                    d.keyboard_clock_low,
                    d.keyboard_data_low,
                    d.host_clock_low,
                    d.host_data_low,
                )
            )
            assert pulls == want, f"pulls {pulls} where the model has {want}"
            typed = int(d.typed.value)
            assert typed == self.model.typed()
            self.typed += typed
            if taken:
                self.inject.pop(0)
            if pulls[2] > self.pulls[2]:
                self.edges["host"].append(h.now)
            if lines[0] == 0 and self.lines[0] == 1:
                self.edges["keyboard"].append(h.now)
            self.pulls, self.lines = pulls, lines
            self.samples.append(lines[2] | lines[3] << 1)
        assert not until, "waited 4 s for nothing"


def without(received, sequence):
    """What is left when the only occurrence of the sequence is cut out; None if it is not in one
    piece there.
    """
    positions = [
        n
        for n in range(len(received) - len(sequence) + 1)
        if received[n : n + len(sequence)] == sequence
    ]
    return (
        received[: positions[0]] + received[positions[0] + len(sequence) :] if positions else None
    )


@cocotb.test()
async def latency_is_at_most_200_us_and_what_is_typed_arrives_unchanged(dut):
    wires = await Wires(dut).begin()
    keys = [
        0x1C,
        0xF0,
        0x1C,
        0xE0,
        0x75,
        0xE0,
        0xF0,
        0x75,
        0xE1,
        0x14,
        0x77,
        0xE1,
        0xF0,
        0x14,
        0xF0,
        0x77,
    ]
    for key in keys:
        wires.edges = {"keyboard": [], "host": []}
        wires.keyboard.outbox = [key]
        await wires.run(6 * MS)
        delay = (wires.edges["host"][10] - wires.edges["keyboard"][10]) / wires.host.us - 10 * 80
        assert 0 < delay <= 200, delay
    assert wires.host.received == keys and wires.host.damaged == 0 and wires.typed == len(keys)


@cocotb.test()
async def commands_reach_the_keyboard_and_their_answers_the_host(dut):
    wires = await Wires(dut).begin()
    orders = [0xED, 0x02, 0xF3, 0x20, 0xEE, 0xF2, 0xFF]
    for order in orders:
        answered = len(wires.host.received)
        wires.host.orders = [order]
        await wires.run(until=lambda answered=answered: len(wires.host.received) > answered)
        await wires.run(12 * MS)
    assert wires.keyboard.commands == orders and wires.host.unanswered == 0 and wires.typed == 0
    assert wires.host.received == [0xFA] * 4 + [0xEE] + [0xFA, 0xAB, 0x83] + [0xFA, 0xAA]


@cocotb.test()
async def the_start_of_a_cut_enters_in_one_piece_while_a_person_types(dut):
    wires = await Wires(dut, keyboard=Keyboard(CLK_HZ, half=33)).begin()
    keys = [0x1C, 0xF0, 0x1C] * 3
    wires.keyboard.outbox = keys[:4]
    wires.inject = list(START)
    await wires.run(until=lambda: len(wires.inject) < 5)  # the person types on during the injection
    wires.keyboard.outbox += keys[4:]
    await wires.run(until=lambda: len(wires.host.received) == len(keys) + len(START))
    await wires.run(10 * MS)
    assert without(wires.host.received, START) == keys and wires.host.damaged == 0


@cocotb.test()
async def a_host_that_cuts_and_orders_at_will_loses_nothing(dut):
    wires = await Wires(dut, Keyboard(CLK_HZ, half=31), Host(CLK_HZ, cut=0.03)).begin()
    keys, orders = [], []
    for turn in range(4):
        more = [random.choice([0x1C, 0xF0, 0x5A, 0xE0, 0x15]) for _ in range(4)] + [0x1C]
        wires.keyboard.outbox, keys = wires.keyboard.outbox + more, keys + more
        wires.inject = list(START) if turn == 1 else wires.inject
        await wires.run(random.randrange(12 * MS))
        order = random.choice([0xED, 0xF3, 0xF4])
        wires.host.orders, orders = [order], [*orders, order]
        await wires.run(until=lambda turn=turn: wires.host.received.count(0xFA) > turn)
        await wires.run(30 * MS)
    await wires.run(until=lambda: not wires.inject and not wires.keyboard.outbox)
    await wires.run(20 * MS)
    received = [
        byte for byte in wires.host.received if byte != 0xFA
    ]  # the answers may come between the keys
    assert without(received, START) == keys and wires.keyboard.commands == orders


@cocotb.test()
async def damaged_bytes_are_asked_for_again_by_their_receiver(dut):
    wires = await Wires(dut, Keyboard(CLK_HZ, damage=0.3)).begin()
    keys = [0x1C, 0x1B, 0x23, 0x2B, 0x34]
    for key in keys:
        received = len(wires.host.received)
        wires.keyboard.outbox = [key]
        await wires.run(until=lambda received=received: len(wires.host.received) > received)
        await wires.run(3 * MS)
    assert wires.host.received == keys and wires.host.damaged > 0


@cocotb.test()
async def reset_in_mid_frame_lets_go_of_all_lines(dut):
    wires = await Wires(dut).begin()
    wires.keyboard.outbox = [0x1C]
    await wires.run(until=lambda: wires.pulls[2])
    dut.rst.value = 1
    await FallingEdge(dut.clk)
    assert not any(
        int(p.value)
        for p in (
            dut.keyboard_clock_low,
            dut.keyboard_data_low,
            dut.host_clock_low,
            dut.host_data_low,
        )
    )


class Recording(Party):
    """The recorded lines of a real keyboard and its host; pauses are shortened to 5 ms."""

    def live(self):
        changes = list(rows(KEYBOARD))
        for (at, clock, data), (end, _, _) in zip(changes, changes[1:]):
            self.clock_low, self.data_low = 1 - clock, 1 - data
            yield from self.wait(min((end - at) / 24, 5000))
        self.clock_low = self.data_low = 0
        while True:
            yield


@cocotb.test(skip=not KEYBOARD.exists() or not sigrok.installed())
async def a_recorded_keyboard_passes_and_sigrok_reads_it_with_the_injection_after_it(dut):
    """sigrok takes the clock of a pulling host for the twelfth bit of a byte: this host pulls once
    after each, as the recorded one.
    """
    wires = await Wires(dut, keyboard=Recording(CLK_HZ), host=Host(CLK_HZ, pause=150)).begin()
    await wires.run(until=lambda: len(wires.host.received) == len(TYPED))
    wires.inject = list(START)
    await wires.run(until=lambda: len(wires.host.received) == len(TYPED) + len(START))
    await wires.run(2 * MS)
    assert wires.host.received == [*TYPED, *START]
    assert sigrok.ps2(wires.samples, CLK_HZ) == (bytes([*TYPED, *START]), 0)


def test_ps2_pass():
    if not KEYBOARD.exists() or not sigrok.installed():
        print("no recording or no sigrok-cli (make sigrok): one test is skipped")
    bench.run("ps2_pass", __file__, CLK_HZ=CLK_HZ)

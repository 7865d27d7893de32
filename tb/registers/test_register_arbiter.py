# SPDX-License-Identifier: Apache-2.0
"""register_arbiter: one master alone, several at once, the two words of wide registers, low words
without their high words, reset in the middle; the model runs beside it in every cycle.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from tb.bench import needs, run, start
from tb.registers.register_arbiter import LOW, RegisterArbiter, bit

POSITION = 0x428  # of axis 0, 64 bits
SETTING = 0x4B0  # profile_position of axis 0, a setting of 64 bits
WORD = 0x420  # 32 bits
assert {POSITION // 4, SETTING // 4} < LOW and not {WORD // 4, WORD // 4 - 1} & LOW


class Master:
    """Makes the accesses of a list, one after the other, as soft_core does."""

    def __init__(self):
        self.todo, self.done, self.pause = [], [], 0
        self.since = 9  # cycles since select
        self.access = (WORD, None)  # address, and word to be written
        self.select = 0

    @property
    def request(self):
        return int(bool(self.todo) and not self.pause and self.since > 2)

    @property
    def shown(self):
        return self.todo[0][:2] if self.request else self.access

    def step(self, ready, rdata, rst):
        taken = self.request and ready and not rst
        self.since += 1
        if self.since == 3 and self.select == 0 and self.access[1] is None:
            self.done.append((self.access[0], rdata))
        self.pause = max(0, self.pause - 1)
        self.select = int(taken)
        if taken:
            *self.access, self.pause = self.todo.pop(0)
            self.since = 0


class Registers:
    """Wide registers that count the cycles, and one wide setting, as register blocks have them."""

    def __init__(self):
        self.time, self.high, self.rdata = 0, 0, [0, 0]
        self.low, self.setting, self.stored = 0, 0, []

    def step(self, select, address, write, wdata):
        """Returns what a master reads in this cycle."""
        self.time += 1
        live = self.time | self.time << 32
        word = 0
        if select and not write:
            word = self.high if address & 4 else live & 0xFFFF_FFFF
            self.high = self.high if address & 4 else live >> 32
        if select and write:
            if address & 4:
                self.setting = wdata << 32 | self.low
                self.stored.append(self.setting)
            self.low = self.low if address & 4 else wdata
        self.rdata = [*self.rdata[1:], word]
        return self.rdata[0]


class Bench:
    def __init__(self, dut):
        self.dut, self.masters = dut, [Master() for _ in range(int(dut.MASTERS.value))]
        self.hold = int(dut.HOLD.value)
        self.model, self.registers = RegisterArbiter(len(self.masters), self.hold), Registers()
        self.order, self.cycles, self.rdata = [], 0, 0  # masters that had an access, in order

    async def begin(self):
        n = len(self.masters)
        await start(self.dut, request=0, waits=0, select=0, write=0, address=0, bus_ready=0)
        await self.clk(rst=1)
        assert n == self.model.masters
        return self

    async def clk(self, bus_ready=1, waits=0, rst=0):
        """One cycle; returns ready."""
        number = range(len(self.masters))
        gather = lambda get, bits: sum(get(self.masters[n]) << bits * n for n in number)
        address = [m.shown[0] for m in self.masters]
        inputs = {
            "request": gather(lambda m: m.request, 1),
            "select": gather(lambda m: m.select, 1),
            "write": gather(lambda m: int(m.shown[1] is not None), 1),
            "address": gather(lambda m: m.shown[0], 16),
            "wdata": gather(lambda m: m.shown[1] or 0, 32),
            **{"waits": waits, "bus_ready": bus_ready, "rst": rst},
        }
        for name, level in inputs.items():
            getattr(self.dut, name).value = level
        await Timer(1, "ns")  # much less than a cycle
        ready = self.model.ready(waits, inputs["select"], address, bus_ready)
        shown = self.model.shown([m.shown for m in self.masters])
        want = {
            "ready": ready,
            "bus_select": int(inputs["select"] != 0),
            "bus_write": int(shown[1] is not None),
            "bus_address": shown[0],
            "bus_wdata": shown[1] or 0,
        }
        if self.cycles:
            got = {name: int(getattr(self.dut, name).value) for name in want}
            assert got == want, f"cycle {self.cycles}"
        self.order += [n for n in number if bit(inputs["select"], n)]
        rdata = self.registers.step(
            want["bus_select"], want["bus_address"], want["bus_write"], want["bus_wdata"]
        )
        self.model.step(
            *(inputs[name] for name in ("request", "waits", "select")), address, bus_ready, rst
        )
        for n in number:
            self.masters[n].step(bit(ready, n), rdata, rst)
        self.cycles += 1
        await RisingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        return ready

    async def run(self, cycles):
        for _ in range(cycles):
            await self.clk()

    def several(self):
        needs(len(self.masters) > 1, "one master alone")


def read(address, pause=0):
    return address, None, pause


def wide_read(address=POSITION, between=0, pause=0):
    return [read(address, between), read(address + 4, pause)]


def wide_write(value, between=0, pause=0):
    return [(SETTING, value, between), (SETTING + 4, value, pause)]


def whole(done):
    """The wide values that a master has read: both words must be of the same cycle."""
    words = dict.fromkeys((POSITION, POSITION + 4))
    for address, word in done:
        words[address] = word
        if address == POSITION + 4:
            yield words[POSITION], word


@cocotb.test()
async def latency_is_0_for_master_0_and_1_for_another_on_an_idle_bus(dut):
    bench = await Bench(dut).begin()
    for n, master in enumerate(bench.masters):
        await bench.run(10)
        master.todo = [read(WORD)]
        if n:
            assert not bit(await bench.clk(), n)
        assert bit(await bench.clk(), n)
        await bench.run(10)
        assert len(master.done) == 1


@cocotb.test()
async def no_access_is_given_while_the_bus_is_not_ready_or_the_master_is_held_back(dut):
    bench = await Bench(dut).begin()
    for master in bench.masters:
        master.todo = [read(WORD)]
    for _ in range(20):
        assert not await bench.clk(bus_ready=0)
    held = (1 << len(bench.masters)) - 1
    for _ in range(20):
        assert not await bench.clk(waits=held)
    for _ in range(20):
        await bench.clk(waits=1)
    assert sorted(bench.order) == [*range(1, len(bench.masters))], "only master 0 is held back"
    await bench.run(10)
    assert all(not master.todo for master in bench.masters)


@cocotb.test()
async def masters_that_wait_are_served_in_turn(dut):
    bench = await Bench(dut).begin()
    number = [*range(len(bench.masters))]
    for master in bench.masters:
        master.todo = [read(WORD) for _ in range(5)]
    await bench.run(1 + 4 * 5 * len(number))
    assert bench.order == 5 * number


@cocotb.test()
async def the_words_of_register_width_are_never_torn(dut):
    bench = await Bench(dut).begin()
    for master in bench.masters:
        for _ in range(60):
            between, pause = random.randrange(bench.hold - 2), random.choice([0, 0, 1, 7])
            master.todo += random.choice(
                [
                    wide_read(POSITION, between, pause),
                    wide_write(random.getrandbits(32), between, pause),
                    [read(WORD, pause)],
                    [read(POSITION, random.randrange(2 * bench.hold))],  # without its high word
                ]
            )
    while any(master.todo or master.since < 3 for master in bench.masters):
        await bench.clk(bus_ready=int(random.random() < 0.8))
    assert len(bench.registers.stored) > 10
    assert all(x >> 32 == x & 0xFFFF_FFFF for x in bench.registers.stored)
    for master in bench.masters:
        values = [*whole(master.done)]
        assert len(values) > 5 and all(low == high for low, high in values)


@cocotb.test()
async def a_master_that_reads_low_words_alone_does_not_keep_the_bus(dut):
    bench = await Bench(dut).begin()
    bench.several()
    bench.masters[0].todo = [read(POSITION) for _ in range(20)]
    await bench.run(6)
    bench.masters[1].todo = [read(WORD) for _ in range(10)]
    await bench.run(10 * 10)
    assert not bench.masters[1].todo


@cocotb.test()
async def a_reservation_ends_after_hold_cycles_without_a_request(dut):
    bench = await Bench(dut).begin()
    bench.several()
    bench.masters[0].todo = [read(POSITION)]
    await bench.run(2)
    bench.masters[1].todo = [read(WORD)]
    waited = 0
    while bench.masters[1].todo:
        await bench.clk()
        waited += 1
    assert bench.hold <= waited <= bench.hold + 3


@cocotb.test()
async def a_reset_ends_an_access_at_each_point(dut):
    bench = await Bench(dut).begin()
    for cycles in range(9):
        for master in bench.masters:
            master.todo = wide_read()
        await bench.run(cycles)
        await bench.clk(rst=1)
        for master in bench.masters:
            master.todo, master.select = [], 0
        await bench.run(10)
    for master in bench.masters:
        master.done.clear()
        master.todo = [read(WORD)]
    await bench.run(8 * len(bench.masters))
    assert all(len(master.done) == 1 for master in bench.masters)


@cocotb.test()
async def any_accesses_match_the_model(dut):
    bench = await Bench(dut).begin()
    addresses = (WORD, WORD + 4, POSITION, POSITION + 4, SETTING, SETTING + 4, 0xFFFC)
    for _ in range(3000):
        for master in bench.masters:
            if not master.todo and random.random() < 0.3:
                word = random.choice([None, random.getrandbits(32)])
                pause = random.choice([0, 1, bench.hold, 2 * bench.hold])
                master.todo = [(random.choice(addresses), word, pause)]
        held = random.getrandbits(len(bench.masters)) if random.random() < 0.2 else 0
        await bench.clk(int(random.random() < 0.9), held, int(random.random() < 0.01))
    assert len(bench.order) > 30 and set(bench.order) == {*range(len(bench.masters))}


@pytest.mark.parametrize("masters, hold", [(1, 63), (2, 63), (3, 9), (4, 20)])
def test_register_arbiter(masters, hold):
    run("register_arbiter", __file__, MASTERS=masters, HOLD=hold)

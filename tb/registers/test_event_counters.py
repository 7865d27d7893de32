# SPDX-License-Identifier: Apache-2.0
"""event_counters: single events, all at once, both ends of the range, events beside reads and
clears, reset in the middle, and random events against the model in every cycle.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.registers.event_counters import EventCounters

COUNTERS, W = 8, 5
MOST = (1 << W) - 1


class Bench:
    def __init__(self, dut):
        self.dut, self.model = dut, EventCounters(COUNTERS, W)

    async def begin(self):
        await start(self.dut, events=0, read=0, clear=0, number=0)
        await self.clk(rst=1)
        await self.idle(2 * COUNTERS)
        return self

    async def clk(self, events=(), read=0, clear=0, number=0, rst=0):
        dut = self.dut
        dut.events.value = sum(1 << n - 1 for n in events)
        dut.read.value, dut.clear.value, dut.number.value, dut.rst.value = read, clear, number, rst
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        want = self.model.step(set(events), read, clear, number, rst)
        assert not (read and not rst) or int(dut.count.value) == want
        return want

    async def idle(self, cycles=4 * COUNTERS + 1):
        for _ in range(cycles):
            await self.clk()

    async def count(self, number):
        return await self.clk(read=1, number=number)


@cocotb.test()
async def every_counter_counts_its_own_events(dut):
    bench = await Bench(dut).begin()
    assert [await bench.count(n) for n in range(COUNTERS)] == [0] * COUNTERS
    for n in range(COUNTERS):
        for _ in range(n):
            await bench.clk([n])
            await bench.idle(2 * COUNTERS)
    await bench.idle()
    assert [await bench.count(n) for n in range(COUNTERS)] == list(range(COUNTERS))


@cocotb.test()
async def latency_is_4_times_the_counters_and_1_more_at_most(dut):
    bench = await Bench(dut).begin()
    for delay in range(2 * COUNTERS):
        await bench.idle(delay)
        await bench.clk(range(1, COUNTERS))
        await bench.idle(4 * COUNTERS)
        assert [await bench.count(n) for n in range(1, COUNTERS)] == [delay + 1] * (COUNTERS - 1)


@cocotb.test()
async def a_count_stops_at_its_largest_value_and_a_clear_counts_its_own_event(dut):
    bench = await Bench(dut).begin()
    for n in range(MOST + 3):
        await bench.clk([7])
        await bench.idle()
        assert await bench.count(7) == min(n + 1, MOST)
    await bench.clk([7], clear=1, number=7)
    await bench.idle()
    assert await bench.count(7) == 1
    await bench.clk(clear=1, number=7)
    await bench.clk()
    assert await bench.count(7) == 0


@cocotb.test()
async def no_event_is_lost_beside_reads_and_clears(dut):
    """Each event waits for all others and for the accesses at most as long as the header says."""
    bench = await Bench(dut).begin()
    counts = [0] * COUNTERS
    for _ in range(200):
        events = [n for n in range(1, COUNTERS) if random.getrandbits(1)]
        for n in events:
            counts[n] = min(counts[n] + 1, MOST)
        waits, kind = 0, ""
        for cycle in range(2 * COUNTERS + 1):
            kind = random.choice(["read", "", "", ""])
            waits += bool(kind)
            number = random.randrange(1, COUNTERS)
            await bench.clk([] if cycle else events, kind == "read", 0, number)
        await bench.idle(2 * waits)
        if random.random() < 0.3:
            await bench.idle()
            number = random.randrange(1, COUNTERS)
            await bench.clk(clear=1, number=number)
            counts[number] = 0
    await bench.idle()
    assert [await bench.count(n) for n in range(COUNTERS)] == counts


@cocotb.test()
async def random_events_match_the_model_in_every_cycle(dut):
    bench = await Bench(dut).begin()
    last = ""
    for n in range(4000):
        rate = (0.0, 0.02, 0.3)[n // 100 % 3]
        events = [n for n in range(1, COUNTERS) if random.random() < rate]
        # a clear is done in the cycle after it
        kind = "" if last == "clear" else random.choice(["read", "clear", "", "", "", ""])
        last, rst = kind, random.random() < 0.003
        number = random.randrange(kind == "clear", COUNTERS)
        await bench.clk(events, kind == "read", kind == "clear", number, int(rst))
        if rst:
            await bench.idle(2 * COUNTERS)


def test_event_counters():
    run("event_counters", __file__, COUNTERS=COUNTERS, W=W)

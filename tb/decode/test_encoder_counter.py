# SPDX-License-Identifier: Apache-2.0
"""Tests of encoder_counter: its words by hand, latencies, flags, probe and index, and random pins
and accesses against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import needs, run, start
from tb.decode.encoder_counter import ARM, FOUND, ILLEGAL, PROBED, EncoderCounter

TURN = [(0, 0), (1, 0), (1, 1), (0, 1)]  # a leads b: up
UP, DOWN, EACH, CLEARS, PROBE, PROBE_LOW = (1 << n for n in range(10, 16))


class Bench:
    """The design and its model side by side, with the pins of a scale at `position`."""

    @classmethod
    async def begin(cls, dut, settings=0):
        bench = cls()
        bench.dut, bench.now, bench.z, bench.probe, bench.position = dut, 0, 0, 0, 0
        bench.model = EncoderCounter(
            *(int(getattr(dut, name).value) for name in ("FILTER_W", "TOLERATED_W", "SKIP_W"))
        )
        await start(dut, select=0, write=0, word=0, wdata=0, now=0, a=0, b=0, z=0, probe=0)
        await FallingEdge(dut.clk)
        for _ in range(3):
            bench.model.step(0, 0, 0, rst=1)
        await bench.cycle(rst=1)
        await bench.wait(12)
        await bench.write(2, settings)
        return bench

    async def cycle(self, levels=None, rst=0, **access):
        a, b = levels or TURN[self.position % 4]
        self.now = (self.now + 1) % 65536
        pins = dict(
            a=a,
            b=b,
            z=self.z,
            probe=self.probe,
            now=self.now,
            rst=rst,
            **dict(select=0, write=0, word=0, wdata=0) | access,
        )
        for name, value in pins.items():
            getattr(self.dut, name).value = value
        await FallingEdge(self.dut.clk)
        want, got = self.model.step(**pins), self.dut.rdata.value
        assert want is None or int(got) == want, (
            f"word {pins['word']}: read {got}, the model has {want:08x}"
        )
        return want

    async def wait(self, cycle, **more):
        for _ in range(cycle):
            await self.cycle(**more)

    async def write(self, word, wdata):
        await self.cycle(select=1, write=1, word=word, wdata=wdata)

    async def read(self, word):
        return await self.cycle(select=1, word=word)

    async def go(self, positions, cycle=1):
        for position in positions:
            self.position = position
            await self.wait(cycle)

    async def count(self):
        return await self.read(0) & 0xFFFF

    async def latched(self):
        return await self.read(1) >> 16

    async def flags(self):
        return await self.read(1) & (FOUND | PROBED | ILLEGAL | ARM)


@cocotb.test()
async def count_and_the_time_of_its_last_edge_are_read_together(dut):
    bench = await Bench.begin(dut)
    await bench.go(range(1, 8), cycle=5)
    moved = bench.now - 4  # the cycle in which the last edge reached the pins
    assert (
        await bench.read(0) == moved + 3 - 1 << 16 | 7
    )  # 3 cycles to count; the time is that of the preceding cycle
    await bench.go(range(6, -4, -1), cycle=5)
    assert await bench.count() == 0xFFFD


@cocotb.test()
async def latency_is_n_samples_and_2_cycles_from_the_pins_and_1_to_rdata(dut):
    for required in (0, 1):
        bench = await Bench.begin(dut, required)
        await bench.go(range(1, 5), cycle=5)  # the time is undefined before the first step
        await bench.wait(4)
        bench.position = 5
        assert [await bench.count() for _ in range(4)] == [4, 4, 4, 5]
    needs(int(dut.FILTER_W.value) > 1, "built without longer filters")
    bench = await Bench.begin(dut, 3)
    await bench.go(range(1, 5), cycle=5)
    await bench.wait(4)
    bench.position = 5
    assert [await bench.count() for _ in range(6)] == [4] * 5 + [5]


@cocotb.test()
async def latency_is_1_from_select_to_rdata_and_from_a_write_to_the_new_setting(dut):
    bench = await Bench.begin(dut)
    await bench.write(2, UP)
    dut.write.value, dut.wdata.value = 0, 0
    assert int(dut.rdata.value) == 0 and await bench.read(2) == UP == int(dut.rdata.value)


@cocotb.test()
async def rdata_is_0_when_nothing_is_read_and_word_3_does_not_exist(dut):
    bench = await Bench.begin(dut, UP | EACH)
    await bench.go(range(1, 4))
    assert (
        await bench.cycle(word=2) == 0
        and await bench.read(3) == 0
        and await bench.read(2) == UP | EACH
    )


@cocotb.test()
async def settings_that_do_not_exist_read_0(dut):
    bench = await Bench.begin(dut)
    filter_w, tolerated_w, skip_w = (
        int(getattr(dut, name).value) for name in ("FILTER_W", "TOLERATED_W", "SKIP_W")
    )
    for value in (0xFFFFFFFF, 0, 0xA5A5A5A5):
        await bench.write(2, value)
        there = (
            value & 0xFFF0
            | value & 2**filter_w - 1
            | value & (2**tolerated_w - 1) << 16
            | value & (2**skip_w - 1) << 20
        )
        assert await bench.read(2) == there


@cocotb.test()
async def an_index_clears_and_latches_exactly_on_a_count_edge(dut):
    for clears, count in ((0, 9), (CLEARS, 3)):
        bench = await Bench.begin(dut, UP | EACH | clears)
        for position in range(1, 10):
            bench.z = int(position == 6)
            await bench.go([position], cycle=2)
        bench.z = 0
        await bench.wait(6)
        assert (
            await bench.count() == count
            and await bench.latched() == 6
            and await bench.flags() == FOUND
        )
        await bench.write(1, FOUND)
        assert await bench.flags() == 0 and await bench.latched() == 6


@cocotb.test()
async def once_takes_one_index_for_each_arm(dut):
    bench = await Bench.begin(dut, UP)
    for armed in (0, 1, 0):
        if armed:
            await bench.write(1, ARM)
            assert await bench.flags() == ARM
        before = await bench.flags()
        bench.z = 1
        await bench.go([bench.position + 1], cycle=6)
        bench.z = 0
        await bench.wait(6)
        assert await bench.flags() == (FOUND if armed else before & ~ARM)
        await bench.write(1, FOUND)


@cocotb.test()
async def a_probe_latches_the_count_of_its_own_cycle_at_the_chosen_edge(dut):
    for low in (0, 1):
        bench = await Bench.begin(dut, PROBE | low * PROBE_LOW)
        # one edge per cycle: the count of exactly this cycle is latched
        for position in range(1, 13):
            bench.probe = int(4 <= position < 9)
            await bench.go([position])
        await bench.wait(4)
        assert await bench.latched() == (9 if low else 4) and await bench.flags() == PROBED
        bench.probe = 0
        await bench.wait(4)
        await bench.write(1, PROBED)
        assert await bench.flags() == 0


@cocotb.test()
async def latency_is_3_from_probe_to_the_latched_count(dut):
    bench = await Bench.begin(dut, PROBE)
    await bench.go(range(1, 6))
    await bench.wait(4)
    bench.probe = 1
    assert [await bench.latched() for _ in range(5)] == [0, 0, 0, 5, 5]


@cocotb.test()
async def a_disabled_probe_and_new_settings_latch_nothing(dut):
    bench = await Bench.begin(dut)
    await bench.go(range(1, 4))
    bench.probe = 1
    await bench.wait(4)
    for settings in (PROBE, PROBE | PROBE_LOW, PROBE, 0, PROBE_LOW):
        await bench.write(2, settings)
        await bench.wait(4)
    assert await bench.flags() == 0 and await bench.latched() == 0


@cocotb.test()
async def an_illegal_edge_is_not_counted_and_its_flag_stays_until_it_is_cleared(dut):
    bench = await Bench.begin(dut)
    await bench.go(range(1, 3))
    await bench.wait(4)
    await bench.go([4], cycle=5)  # from (1, 1) to (0, 0)
    assert await bench.count() == 2 and await bench.flags() == ILLEGAL
    await bench.write(1, FOUND | PROBED)
    assert await bench.flags() == ILLEGAL
    await bench.write(1, ILLEGAL)
    assert await bench.flags() == 0


@cocotb.test()
async def an_event_in_the_cycle_that_clears_its_flag_sets_it_again(dut):
    bench = await Bench.begin(dut)
    await bench.go([2])
    for _ in range(6):  # one of these cycles coincides with the edge
        await bench.write(1, ILLEGAL)
        bench.position += 2
    await bench.wait(4)
    assert await bench.flags() == ILLEGAL


@cocotb.test()
async def pulses_shorter_than_the_filter_never_count(dut):
    required = (1 << int(dut.FILTER_W.value)) - 1
    bench = await Bench.begin(dut, required)
    await bench.go(range(1, 3), cycle=required + 4)
    for _ in range(5):
        await bench.wait(required - 1, levels=(0, 1))
        await bench.wait(required + 2)
    assert await bench.count() == 2
    bench.position = 3
    assert [await bench.count() for _ in range(required + 3)].index(3) == max(required, 1) + 2


@cocotb.test()
async def reset_in_mid_flow_forgets_all_but_the_pins(dut):
    bench = await Bench.begin(dut, UP | EACH | PROBE)
    bench.z = 1
    await bench.go(range(1, 6), cycle=2)
    await bench.cycle(rst=1)
    await bench.wait(20)
    assert (
        await bench.count() == 0
        and await bench.read(2) == 0
        and await bench.flags() == 0
        and await bench.latched() == 0
    )


@cocotb.test()
async def settings_and_pins_in_the_first_cycles_after_a_reset_match_the_model(dut):
    bench, bits = await Bench.begin(dut), random.getrandbits
    for _ in range(80):
        bench.z = bits(1)
        await bench.cycle(rst=1)
        await bench.write(2, bits(32) & 0x0001F3F1 | UP | EACH)
        direction = random.choice([-1, 1])
        for n in range(12):
            bench.position += direction
            bench.z = bits(1)
            await bench.cycle(**(dict(select=1, write=1, word=1, wdata=ARM) if n == 0 else {}))
        await bench.flags()
        await bench.latched()


@cocotb.test()
async def any_pins_and_accesses_match_the_model_in_every_cycle(dut):
    bench, bits = await Bench.begin(dut), random.getrandbits
    for _ in range(100):
        mask = 0xFFF3FFF3 if random.random() < 0.2 else 0x0011FFF3  # short filters, or any
        await bench.write(2, bits(32) & mask)
        direction, cycle = random.choice([-1, 1]), random.choice([1, 1, 2, 6])
        for n in range(60):
            if n % cycle == 0:
                direction = -direction if random.random() < 0.1 else direction
                bench.position += direction * random.choice([0, 1, 1, 1, 1, 1, 1, 2])
                bench.z, bench.probe = (
                    int(bench.position % 12 in (0, 1)),
                    bench.probe ^ (random.random() < 0.1),
                )
            access = (
                dict(select=bits(1), write=bits(1), word=1, wdata=bits(8) & bits(8))
                if random.random() < 0.2
                else dict(select=bits(1), write=0, word=bits(2), wdata=bits(32))
            )
            await bench.cycle(rst=int(random.random() < 0.002), **access)


@pytest.mark.parametrize("filter_w, tolerated_w, skip_w", [(4, 0, 0), (1, 0, 0), (3, 2, 4)])
def test_encoder_counter(filter_w, tolerated_w, skip_w):
    run("encoder_counter", __file__, FILTER_W=filter_w, TOLERATED_W=tolerated_w, SKIP_W=skip_w)

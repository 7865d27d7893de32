# SPDX-License-Identifier: Apache-2.0
"""Tests of event_filter: N samples in a row and N of M, the sampling divider, the bypass, both ends
of the settings, and random levels against the model.
"""

import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.deglitcher import Deglitcher
from tb.sense.event_filter import EventFilter


class Bench:
    """The design and its model side by side; play() applies the same levels to every input and
    returns (filtered, rejected) of input 0.
    """

    @classmethod
    async def begin(cls, dut, level=0, skip=0, required=0, tolerated=0, started=True):
        bench = cls()
        bench.dut, bench.lines = dut, int(dut.LEVELS.value)
        bench.model = EventFilter(bench.lines, int(dut.SETTLE.value))
        bench.settings = skip, required, tolerated
        await start(
            dut,
            level=bench.word([level] * bench.lines),
            skip=skip,
            required=required,
            tolerated=tolerated,
        )
        bench.model.step(skip, required, tolerated, [level] * bench.lines, 1)
        if started:
            await bench.play([level] * int(dut.SETTLE.value))
        return bench

    @staticmethod
    def word(levels):
        return sum(level << n for n, level in enumerate(levels))

    async def set(self, skip=0, required=0, tolerated=0):
        """Apply new settings, and wait until they are in force, with constant levels."""
        self.settings = skip, required, tolerated
        await self.rows([[own.filtered for own in self.model.levels]])

    async def rows(self, rows, rst=0):
        dut, out = self.dut, []
        dut.skip.value, dut.required.value, dut.tolerated.value = self.settings
        dut.rst.value = rst
        for cycle, levels in enumerate(rows):
            dut.level.value = self.word(levels)
            await RisingEdge(dut.clk)
            await FallingEdge(dut.clk)
            filtered, rejected = self.model.step(*self.settings, levels, rst)
            got, want = (
                (int(dut.filtered.value), int(dut.rejected.value)),
                (self.word(filtered), self.word(rejected)),
            )
            assert got == want, (
                f"cycle {cycle}, (skip, required, tolerated) {self.settings}: "
                f"(filtered, rejected) is {got}, the model has {want}"
            )
            out.append((filtered[0], rejected[0]))
        dut.rst.value = 0
        return out

    async def play(self, levels, rst=0):
        return await self.rows([[level] * self.lines for level in levels], rst)


@cocotb.test()
async def latency_is_1_during_start_up(dut):
    bench = await Bench.begin(dut, skip=9, required=7, started=False)
    for level in [1, 0] * (int(dut.SETTLE.value) // 2):
        assert await bench.play([level]) == [(level, 0)]


@cocotb.test()
async def latency_is_n_samples_from_a_clean_edge(dut):
    bench = await Bench.begin(dut)
    for required in (0, 1, 2, 3, 7):
        for tolerated in (0, 1, 3):
            for level in (1, 0):
                await bench.set(0, required, tolerated)
                out = await bench.play([level] * (required + 2))
                assert [filtered for filtered, _ in out].index(level) + 1 == max(1, required)


@cocotb.test()
async def with_tolerated_0_and_skip_0_it_equals_the_deglitcher(dut):
    for required in (0, 1, 2, 5, 8):
        bench, other = await Bench.begin(dut, required=required), Deglitcher(int(dut.SETTLE.value))
        other.step(required, 0, 1)
        for _ in range(int(dut.SETTLE.value)):
            other.step(required, 0)
        levels = [bit for _ in range(60) for bit in [random.getrandbits(1)] * random.randint(1, 9)]
        assert await bench.play(levels) == [other.step(required, level) for level in levels]


@cocotb.test()
async def latency_is_1_in_bypass(dut):
    bench = await Bench.begin(dut)
    levels = [random.getrandbits(1) for _ in range(60)]
    assert await bench.play(levels) == [(level, 0) for level in levels]


@cocotb.test()
async def three_of_four_passes_and_two_of_four_is_rejected_and_reported_once(dut):
    bench = await Bench.begin(dut)
    await bench.set(0, 3, 1)
    assert await bench.play([1, 0, 1, 1]) == [(0, 0)] * 3 + [(1, 0)]
    assert await bench.play([1] * 4) == [(1, 0)] * 4
    assert await bench.play([0, 1, 0, 1, 1, 1]) == [(1, 0)] * 3 + [(1, 1)] + [(1, 0)] * 2
    assert await bench.play([0, 0, 1, 0]) == [(1, 0)] * 3 + [(0, 0)]


@cocotb.test()
async def a_pulse_of_too_few_samples_never_passes_at_any_setting(dut):
    bench = await Bench.begin(dut)
    for skip in (0, 1, 2):
        for required in (2, 3, 6):
            for tolerated in (0, 1, 2):
                await bench.set(skip, required, tolerated)
                await bench.play([0] * 30)
                width = (required - 1) * (skip + 1)
                pause = (tolerated + 2) * (skip + 1)
                out = await bench.play(([1] * width + [0] * pause) * 4)
                assert not any(filtered for filtered, _ in out)
                assert sum(rejected for _, rejected in out) == 4


@cocotb.test()
async def a_pulse_of_n_sample_periods_passes_wherever_it_begins(dut):
    for skip in (1, 2, 3):
        for phase in range(skip + 1):
            bench = await Bench.begin(dut, skip=skip, required=4)
            await bench.play([0] * (7 + phase))
            out = await bench.play([1] * (4 * (skip + 1)) + [0] * 3)
            assert any(filtered for filtered, _ in out)


@cocotb.test()
async def a_level_that_is_constant_from_power_up_makes_no_edge(dut):
    for level in (1, 0):
        bench = await Bench.begin(dut, level, 3, 7, 1, started=False)
        assert await bench.play([level] * 40) == [(level, 0)] * 40


@cocotb.test()
async def the_longest_setting_passes_after_exactly_that_many_samples(dut):
    longest = (1 << int(dut.W.value)) - 1
    bench = await Bench.begin(dut)
    await bench.set(0, longest, 0)
    assert await bench.play([1] * longest) == [(0, 0)] * (longest - 1) + [(1, 0)]
    assert (await bench.play([0] * (longest - 1) + [1]))[-1] == (1, 1)


@cocotb.test()
async def every_bit_of_the_settings_and_of_the_counters_counts(dut):
    bench = await Bench.begin(dut)
    powers = [1 << bit for bit in range(int(dut.SKIP_W.value))]
    for seen in powers[: int(dut.W.value)]:
        await bench.set(0, seen + 1, 0)
        assert (await bench.play([1] * seen + [0]))[-1] == (0, 1)
        for level in (1, 0):
            out = await bench.play([level] * (seen + 1))
            assert [filtered for filtered, _ in out] == [1 - level] * seen + [level]
    for tolerated in powers[: int(dut.TOLERATED_W.value)]:
        await bench.set(0, 2, tolerated)
        assert (await bench.play([1] + [0] * (tolerated + 1)))[-1] == (0, 1)
        assert (await bench.play([1] + [0] * tolerated + [1]))[-1] == (1, 0)
        await bench.play([0] * 2)
    for skip in powers:
        await bench.set(skip, 1, 0)
        changes = []
        for level in (1, 0):
            out = await bench.play([level] * (skip + 1))
            changes.append([filtered for filtered, _ in out].index(level))
        assert changes[0] == changes[1], "a sample per skip + 1 cycles"


@cocotb.test()
async def levels_do_not_disturb_each_other(dut):
    bench = await Bench.begin(dut)
    await bench.set(0, 3, 0)
    for line in range(bench.lines):
        await bench.rows(
            [[int(n == line) for n in range(bench.lines)]] * 3 + [[0] * bench.lines] * 3
        )
        await bench.rows([[random.getrandbits(1) for _ in range(bench.lines)] for _ in range(200)])
        await bench.play([0] * 10)


@cocotb.test()
async def reset_in_the_middle_of_a_pulse_forgets_it(dut):
    bench = await Bench.begin(dut)
    await bench.set(0, 6, 1)
    await bench.play([1] * 5)
    await bench.play([0], rst=1)
    assert await bench.play([0] * 10) == [(0, 0)] * 10


@cocotb.test()
async def any_levels_and_any_change_of_settings_match_the_model(dut):
    bench = await Bench.begin(dut)
    for _ in range(150):
        await bench.set(
            random.choice([0, 0, 1, 2, 5]),
            random.choice([0, 1, 2, 3, 5, 7]),
            random.choice([0, 0, 1, 2, 3]),
        )
        pulse = random.choice([1, 2, 4, 12])
        rows = [
            [random.getrandbits(1) for _ in range(bench.lines)]
            for _ in range(40 // pulse)
            for _ in range(1)
        ]
        await bench.rows([row for row in rows for _ in range(random.randint(1, pulse))])
        if random.random() < 0.05:
            await bench.rows(rows[:2], rst=1)


@pytest.mark.parametrize("levels, w, settle", [(1, 8, 4), (3, 4, 1)])
def test_event_filter(levels, w, settle):
    run("event_filter", __file__, LEVELS=levels, W=w, SETTLE=settle)

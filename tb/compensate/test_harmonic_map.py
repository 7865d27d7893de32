# SPDX-License-Identifier: Apache-2.0
"""harmonic_map: a sine by hand, latency and round, accuracy over the turn, staleness at speed,
swaps, and any motion against the model.
"""

import math
import random
import re

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from tb.bench import ROOT, run, start
from tb.compensate.harmonic_map import HarmonicMap, exact, round_of, term_of

IDLE = dict(
    enable=0,
    radians_per_count=0,
    write=0,
    term=0,
    amplitude=0,
    phase=0,
    swap=0,
    angle=0,
    step=0,
    position=0,
)
STROBES = "write", "swap", "step"
COUNTS = 32768
ARCSEC = 1_296_000 / COUNTS  # of a count


class Map:
    """The design with the model beside it in every cycle, and the encoder that makes angle of step."""

    def __init__(self, dut):
        self.dut, self.inputs, self.place = dut, dict(IDLE), 0
        self.k = int(dut.K.value)
        self.model = HarmonicMap(self.k)
        self.round = round_of(self.k)

    async def reset(self, terms=(), counts=COUNTS):
        self.counts = counts
        self.inputs.update(radians_per_count=round(2 * math.pi * 2**40 / counts))
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        await self.clk(rst=1)
        await self.give(())  # whatever an earlier test left in the other set
        await self.give(terms)
        return self

    async def give(self, terms):
        """Write a set and put it in force."""
        self.terms = [*terms, *[(0, 0)] * (self.k - len(terms))]
        for n, (amplitude, phase) in enumerate(self.terms):
            await self.clk(write=1, term=n, amplitude=amplitude, phase=phase)
        await self.clk(swap=1, enable=1)

    async def clk(self, count=1, rst=0, **inputs):
        for _ in range(count):
            self.inputs.update(
                inputs,
                position=self.place % 2**32,
                angle=round(self.place * 2**32 / self.counts) % 2**32,
            )
            for name, level in self.inputs.items():
                getattr(self.dut, name).value = level
            self.dut.rst.value = rst
            self.model.clk(rst=rst, **self.inputs)
            self.place += self.inputs["step"]
            await RisingEdge(self.dut.clk)
            await FallingEdge(self.dut.clk)
            for name in ("correction", "corrected"):
                got, want = getattr(self.dut, name).value.to_signed(), getattr(self.model, name)
                assert got == want, f"{self.inputs}: {name} is {got}, the model has {want}"
            assert bool(self.dut.refreshed.value) == self.model.refreshed
            for name in STROBES:
                self.inputs[name] = 0

    async def walk(self, steps, pause=0):
        for _ in range(abs(steps)):
            await self.clk(step=1 if steps > 0 else -1)
            if pause:
                await self.clk(pause)

    async def rest(self):
        await self.clk(2 * self.round + 4)

    def error(self):
        """Counts that the correction is off the sum that the terms stand for."""
        return self.model.correction / 2**16 - exact(self.terms, self.place / self.counts)


@cocotb.test()
async def by_hand(dut):
    chart = await Map(dut).reset([term_of(3.0, math.pi / 2)])  # 3 cos
    await chart.rest()
    assert abs(chart.model.correction - 3 * 65536) <= 2
    assert chart.model.corrected == -chart.model.correction
    chart.place = COUNTS // 2
    await chart.rest()
    assert abs(chart.model.correction + 3 * 65536) <= 2
    assert chart.model.corrected == (COUNTS // 2 << 16) - chart.model.correction


@cocotb.test()
async def latency_is_3(dut):
    chart = await Map(dut).reset()
    await chart.rest()
    await chart.clk(step=1)
    seen = []
    for _ in range(4):
        seen.append(dut.corrected.value.to_signed() >> 16)
        await chart.clk()
    assert seen == [0, 0, 1, 1]


@cocotb.test()
async def a_round_is_as_long_as_the_header_says(dut):
    chart = await Map(dut).reset([term_of(1.0, 0)])
    times = []
    for n in range(4 * chart.round):
        await chart.clk()
        if chart.model.refreshed:
            times.append(n)
    assert {b - a for a, b in zip(times, times[1:])} == {24 * (chart.k + chart.k % 2) + 35}


@cocotb.test()
async def all_orders_are_right_to_a_hundredth_of_an_arcsecond(dut):
    chart = await Map(dut).reset(
        [
            term_of(random.uniform(-3, 3) / k, random.uniform(0, 6.3))
            for k in range(1, int(dut.K.value) + 1)
        ]
    )
    for place in (
        0,
        1,
        COUNTS // 4,
        COUNTS // 2,
        3 * COUNTS // 4 - 1,
        COUNTS - 1,
        *(random.randrange(COUNTS) for _ in range(8)),
    ):
        chart.place = place
        await chart.rest()
        assert abs(chart.error()) * ARCSEC <= 0.01


@cocotb.test()
async def largest_amplitudes_do_not_overflow(dut):
    for sign in (1, -1):
        chart = await Map(dut).reset(
            [term_of(sign * 16383.0 / int(dut.K.value), math.pi / 2)] * int(dut.K.value),
            counts=32_768_000,
        )
        for place in (0, chart.counts // 2):
            chart.place = place
            await chart.rest()
            assert abs(chart.error()) < 0.02


@cocotb.test()
async def at_speed_it_is_behind_by_no_more_than_its_bound(dut):
    amplitudes = (3.4, 0.5, 0.2)[: int(dut.K.value)]
    chart = await Map(dut).reset([term_of(amplitude, n) for n, amplitude in enumerate(amplitudes)])
    await chart.rest()
    curve = sum(k * k * a for k, a in enumerate(amplitudes, 1)) * (2 * math.pi / COUNTS) ** 2
    for pause in (1, 7, 40):
        moved = chart.round / (1 + pause)
        await chart.rest()
        for way in (1, -1, 1):
            for _ in range(int(moved * 3)):
                await chart.walk(way, pause)
                assert abs(chart.error()) <= 3 * moved**2 * curve + 0.001


@cocotb.test()
async def at_rest_the_way_there_does_not_matter(dut):
    chart = await Map(dut).reset([term_of(2.0, 1.0)])
    await chart.rest()
    await chart.walk(100)
    await chart.rest()
    from_below = chart.model.correction
    await chart.walk(50)
    await chart.walk(-50)
    await chart.rest()
    assert chart.model.correction == from_below


@cocotb.test()
async def a_set_comes_into_force_as_a_whole(dut):
    first, second = [term_of(2.0, math.pi / 2)], [term_of(-5.0, math.pi / 2)] * int(dut.K.value)
    chart = await Map(dut).reset(first)
    await chart.rest()
    for wait in (0, 1, chart.round // 2, chart.round - 1):
        was = exact(chart.terms, 0)
        await chart.clk(wait + 1)
        await chart.give(second if chart.terms[0] == first[0] else first)
        for _ in range(2 * chart.round):
            await chart.clk()
            assert (
                min(abs(chart.model.correction / 65536 - s) for s in (was, exact(chart.terms, 0)))
                < 0.001
            )
        assert abs(chart.error()) < 0.001


@cocotb.test()
async def nothing_is_corrected_before_the_first_set_nor_without_enable(dut):
    chart = Map(dut)
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    chart.counts, chart.terms = COUNTS, []
    await chart.clk(rst=1)
    await chart.clk(2 * chart.round, enable=1)
    assert chart.model.correction == 0
    await chart.give([term_of(2.0, 1.0)])
    await chart.rest()
    assert chart.model.correction != 0
    await chart.clk(2, enable=0)
    assert chart.model.correction == 0


@cocotb.test()
async def reset_in_mid_flow(dut):
    chart = await Map(dut).reset([term_of(2.0, 1.0)])
    for wait in (1, 5, 30, chart.round - 1):
        await chart.clk(wait)
        await chart.clk(rst=1)
        await chart.clk(2 * chart.round)
        assert chart.model.correction == 0  # a set must be swapped in anew
        await chart.give([term_of(2.0, 1.0)])
        await chart.rest()
        assert abs(chart.error()) < 0.001


@cocotb.test()
async def any_motion_matches_the_model(dut):
    chart = await Map(dut).reset(
        [term_of(random.uniform(-9, 9), random.uniform(0, 6)) for _ in range(int(dut.K.value))]
    )
    way = 1
    for _ in range(6000):
        inputs = {}
        kind = random.randrange(400)
        if kind == 0:
            way = random.choice((-1, 0, 1))
        elif kind < 4:
            inputs.update(
                write=1,
                term=random.randrange(chart.k),
                amplitude=random.randrange(-(2**24), 2**24),
                phase=random.getrandbits(32),
            )
        elif kind == 4:
            inputs["swap"] = 1
        elif kind == 5:
            inputs["enable"] = int(random.randrange(4) > 0)
        elif kind == 6:
            chart.place = random.randrange(COUNTS)
        await chart.clk(
            step=random.choice((0, way)), rst=int(random.randrange(3000) == 0), **inputs
        )


def test_the_page_of_the_relay_says_how_far_it_lags():
    clk_hz, page = 48e6, (ROOT / "docs" / "relay.md").read_text()
    curve = (
        sum(k * k * arcsec for k, arcsec in enumerate((105, 40, 12), 1))
        * (2 * math.pi / COUNTS) ** 2
    )
    for name, rate in (
        ("600 rev/min", 10 * COUNTS),
        ("3 MHz of edges", 3e6),
        ("24 MHz of edges", 24e6),
    ):
        moved = round_of(16) * rate / clk_hz
        told = re.search(rf"^\| {name}.*\| ([\d.]+)\u2033 \|$", page, re.MULTILINE).group(1)
        assert float(told) == pytest.approx(3 * moved**2 * curve, rel=0.2)


@pytest.mark.parametrize("k", [1, 5, 16, 32])
def test_harmonic_map(k):
    run("harmonic_map", __file__, K=k)

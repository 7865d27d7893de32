# SPDX-License-Identifier: Apache-2.0
"""harmonic_map: a sine by hand, latency and length of a round, accuracy over the turn, lag in
motion, swaps, and any motion against the model.
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
ARCSEC = 1_296_000 / COUNTS  # arcseconds per count


class Map:
    """The design with the model beside it in every cycle, and an encoder that turns steps into
    angle and position.
    """

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
        await self.give(())  # clears what an earlier test left in the other set
        await self.give(terms)
        return self

    async def give(self, terms):
        """Write a set of terms and put it in force."""
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

    async def settle(self):
        await self.clk(2 * self.round + 4)

    def error(self):
        """Correction less the exact sum of the terms, in counts."""
        return self.model.correction / 2**16 - exact(self.terms, self.place / self.counts)


@cocotb.test()
async def a_cosine_corrects_by_its_amplitude_at_0_and_half_a_turn(dut):
    design = await Map(dut).reset([term_of(3.0, math.pi / 2)])  # 3 cos
    await design.settle()
    assert abs(design.model.correction - 3 * 65536) <= 2
    assert design.model.corrected == -design.model.correction
    design.place = COUNTS // 2
    await design.settle()
    assert abs(design.model.correction + 3 * 65536) <= 2
    assert design.model.corrected == (COUNTS // 2 << 16) - design.model.correction


@cocotb.test()
async def latency_is_3(dut):
    design = await Map(dut).reset()
    await design.settle()
    await design.clk(step=1)
    seen = []
    for _ in range(4):
        seen.append(dut.corrected.value.to_signed() >> 16)
        await design.clk()
    assert seen == [0, 0, 1, 1]


@cocotb.test()
async def a_round_takes_steps_plus_2_cycles_per_term_and_35(dut):
    design = await Map(dut).reset([term_of(1.0, 0)])
    times = []
    for n in range(4 * design.round):
        await design.clk()
        if design.model.refreshed:
            times.append(n)
    assert {b - a for a, b in zip(times, times[1:])} == {24 * (design.k + design.k % 2) + 35}


@cocotb.test()
async def the_sum_of_all_orders_is_right_to_a_hundredth_of_an_arcsecond(dut):
    design = await Map(dut).reset(
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
        design.place = place
        await design.settle()
        assert abs(design.error()) * ARCSEC <= 0.01


@cocotb.test()
async def the_largest_amplitudes_do_not_overflow(dut):
    for sign in (1, -1):
        design = await Map(dut).reset(
            [term_of(sign * 16383.0 / int(dut.K.value), math.pi / 2)] * int(dut.K.value),
            counts=32_768_000,
        )
        for place in (0, design.counts // 2):
            design.place = place
            await design.settle()
            assert abs(design.error()) < 0.02


@cocotb.test()
async def in_motion_it_lags_by_no_more_than_its_bound(dut):
    amplitudes = (3.4, 0.5, 0.2)[: int(dut.K.value)]
    design = await Map(dut).reset([term_of(amplitude, n) for n, amplitude in enumerate(amplitudes)])
    await design.settle()
    curve = sum(k * k * a for k, a in enumerate(amplitudes, 1)) * (2 * math.pi / COUNTS) ** 2
    for pause in (1, 7, 40):
        moved = design.round / (1 + pause)
        await design.settle()
        for direction in (1, -1, 1):
            for _ in range(int(moved * 3)):
                await design.walk(direction, pause)
                assert abs(design.error()) <= 3 * moved**2 * curve + 0.001


@cocotb.test()
async def at_standstill_the_correction_does_not_depend_on_the_motion_before(dut):
    design = await Map(dut).reset([term_of(2.0, 1.0)])
    await design.settle()
    await design.walk(100)
    await design.settle()
    from_below = design.model.correction
    await design.walk(50)
    await design.walk(-50)
    await design.settle()
    assert design.model.correction == from_below


@cocotb.test()
async def swap_replaces_all_terms_at_once(dut):
    first, second = [term_of(2.0, math.pi / 2)], [term_of(-5.0, math.pi / 2)] * int(dut.K.value)
    design = await Map(dut).reset(first)
    await design.settle()
    for wait in (0, 1, design.round // 2, design.round - 1):
        was = exact(design.terms, 0)
        await design.clk(wait + 1)
        await design.give(second if design.terms[0] == first[0] else first)
        for _ in range(2 * design.round):
            await design.clk()
            assert (
                min(abs(design.model.correction / 65536 - s) for s in (was, exact(design.terms, 0)))
                < 0.001
            )
        assert abs(design.error()) < 0.001


@cocotb.test()
async def nothing_is_corrected_before_the_first_set_nor_without_enable(dut):
    design = Map(dut)
    await start(dut, **IDLE)
    await FallingEdge(dut.clk)
    design.counts, design.terms = COUNTS, []
    await design.clk(rst=1)
    await design.clk(2 * design.round, enable=1)
    assert design.model.correction == 0
    await design.give([term_of(2.0, 1.0)])
    await design.settle()
    assert design.model.correction != 0
    await design.clk(2, enable=0)
    assert design.model.correction == 0


@cocotb.test()
async def reset_in_a_round_ends_the_correction_until_the_next_swap(dut):
    design = await Map(dut).reset([term_of(2.0, 1.0)])
    for wait in (1, 5, 30, design.round - 1):
        await design.clk(wait)
        await design.clk(rst=1)
        await design.clk(2 * design.round)
        assert design.model.correction == 0  # a set must be swapped in again
        await design.give([term_of(2.0, 1.0)])
        await design.settle()
        assert abs(design.error()) < 0.001


@cocotb.test()
async def any_motion_matches_the_model(dut):
    design = await Map(dut).reset(
        [term_of(random.uniform(-9, 9), random.uniform(0, 6)) for _ in range(int(dut.K.value))]
    )
    direction = 1
    for _ in range(6000):
        inputs = {}
        kind = random.randrange(400)
        if kind == 0:
            direction = random.choice((-1, 0, 1))
        elif kind < 4:
            inputs.update(
                write=1,
                term=random.randrange(design.k),
                amplitude=random.randrange(-(2**24), 2**24),
                phase=random.getrandbits(32),
            )
        elif kind == 4:
            inputs["swap"] = 1
        elif kind == 5:
            inputs["enable"] = int(random.randrange(4) > 0)
        elif kind == 6:
            design.place = random.randrange(COUNTS)
        await design.clk(
            step=random.choice((0, direction)), rst=int(random.randrange(3000) == 0), **inputs
        )


def test_docs_relay_prints_the_lag_in_motion():
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
        printed = re.search(rf"^\| {name}.*\| ([\d.]+)\u2033 \|$", page, re.MULTILINE).group(1)
        assert float(printed) == pytest.approx(3 * moved**2 * curve, rel=0.2)


@pytest.mark.parametrize("k", [1, 5, 16, 32])
def test_harmonic_map(k):
    run("harmonic_map", __file__, K=k)

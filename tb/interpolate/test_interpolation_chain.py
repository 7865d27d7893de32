# SPDX-License-Identifier: Apache-2.0
"""Tests of interpolation_chain: its latency, each axis against a chain of its own, full load, an
overrun, a lost fringe, reset in mid-flow, and random use against the model in every cycle.
"""

import math
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from tb.bench import needs, run, start
from tb.interpolate.harmonic_correction import POINTS
from tb.interpolate.interpolation_chain import InterpolationChain, Outputs, OwnChain
from tb.interpolate.signal_correction import Settings
from tb.ports import Ports

# strobes of an axis, by bit
OUTLIER, LIMIT, OFFSET, GAIN, QUADRATURE_ERROR, LOAD, POINT, SWAP = range(8)
IDLE = dict(
    setting=0, setting_written=0, harmonic_enable=0, learn=0, valid=0, sin=0, cos=0, count=0
)


def packed(values, width):
    return sum((value % (1 << width)) << width * n for n, value in enumerate(values))


class Bench:
    """Design and model, with the sample and the count that each axis holds."""

    def __init__(self, dut):
        self.dut, self.ports = dut, Ports(dut)
        self.axes, self.w = int(dut.AXES.value), int(dut.W.value)
        self.harmonics = int(dut.HAS_HARMONICS.value)
        self.apart = int(dut.SAMPLE_CYCLES.value)  # of the samples of an axis
        self.model = InterpolationChain(self.axes, self.w, self.harmonics, self.apart)
        self.held, self.counts = [(0, 0)] * self.axes, [0] * self.axes
        self.everyone = (1 << self.axes) - 1

    @property
    def latency(self):
        return (21 if self.axes == 1 else 22) - (0 if self.harmonics else 4)

    async def begin(self):
        await start(self.dut, **IDLE)
        await FallingEdge(self.dut.clk)
        for axis in range(2 * self.axes):  # all tables are known to design and model
            await self.table([0] * POINTS, axis // 2)
        await self.cycle(rst=1)
        return self

    def word(self, words):
        """(strobes, value) of the settings `words`, which are one register."""
        written, value = words.get("correction", {}), random.getrandbits(32)
        strobes = words.get("load", 0) << LOAD | words.get("swap", 0) << SWAP
        if "outlier" in words:
            step, hold = words["outlier"]
            return 1 << OUTLIER, hold << 24 | step << 16 | value % 65536
        if "limit" in words:
            return 1 << LIMIT, words["limit"] | value >> 20 << 20
        if "sin_offset" in written:
            return 1 << OFFSET, packed((written["sin_offset"], written["cos_offset"]), 16)
        for name, bit in (("gain", GAIN), ("quadrature_error", QUADRATURE_ERROR)):
            if name in written:
                return 1 << bit, written[name] % (1 << 17) | value >> 17 << 17
        if "point" in words:
            point, entry = words["point"]
            return 1 << POINT, point << 18 | entry % (1 << 18) | value >> 26 << 26
        return strobes, value

    async def cycle(self, new=None, axis=0, words=None, enable=None, learn=0, rst=0):
        """New samples by axis, and a setting, which is on the bus in the cycle before its strobe;
        returns what design and model give. A cycle with a setting has another one before it.
        """
        new = new or {}
        strobes, setting = self.word(words or {})
        if words:
            self.ports.drive({"setting": setting})
            await self.cycle(enable=enable, learn=learn)
        enable = self.everyone if enable is None else enable
        for n, sample in new.items():
            self.held[n] = sample
        inputs = {"valid": sum(1 << n for n in new), "rst": rst, "learn": learn}
        inputs |= {"sin": packed([sin for sin, _ in self.held], self.w)}
        inputs |= {"cos": packed([cos for _, cos in self.held], self.w)}
        inputs |= {"count": packed(self.counts, 32), "setting_written": strobes << 8 * axis}
        self.ports.drive(inputs | {"harmonic_enable": enable})
        await FallingEdge(self.dut.clk)
        samples = [(n in new, *self.held[n]) for n in range(self.axes)]
        want = self.model.step(samples, self.counts, axis, words, enable, learn, rst)
        got = self.outputs()
        assert got == want, f"got {got}, the model has {want}"
        return got

    def outputs(self):
        ports = self.ports

        def strobed(strobes, *values, flag=None):
            """(axis, values, flag) if one of the strobes is high."""
            high = ports[strobes]
            axes = [n for n in range(self.axes) if high >> n & 1]
            flagged = flag and ports[flag]
            assert len(axes) <= 1 and flagged in (None, 0, high)
            if not axes:
                return None
            flags = () if flag is None else (int(flagged != 0),)
            return (*axes, *(value() for value in values), *flags)

        return Outputs(
            strobed(
                "sampled",
                lambda: ports.signed("sampled_sin"),
                lambda: ports.signed("sampled_cos"),
                flag="rejected",
            ),
            strobed("phase_valid", lambda: ports["plain_phase"]),
            strobed("done", lambda: ports.signed("step"), lambda: ports["phase"], flag="overspeed"),
            ports["disagreement"],
            ports["overrun"],
            ports["lost"],
        )

    async def table(self, table, axis):
        for entry in enumerate(table):
            await self.cycle(axis=axis, words=dict(point=entry))
        await self.cycle(axis=axis, words=dict(swap=1))

    async def correct(self, settings, axis):
        for part in (("sin_offset", "cos_offset"), ("gain",), ("quadrature_error",)):
            values = {name: getattr(settings, name) for name in part}
            await self.cycle(axis=axis, words=dict(correction=values))
        await self.cycle(axis=axis, words=dict(load=1))

    def point(self, periods):
        """Sample at a position."""
        size = 0.9 * (1 << self.w - 1)
        turn = math.tau * periods
        return round(size * math.sin(turn)), round(size * math.cos(turn))


def draw_settings(w):
    return Settings(
        random.randrange(-2000, 2000),
        random.randrange(-2000, 2000),
        random.randrange(60000, 70000),
        random.randrange(-4000, 4000),
    )


@cocotb.test()
async def latency_is_21_for_one_axis_22_for_several_1_more_for_each_before_and_4_less_without(dut):
    bench = await Bench(dut).begin()
    for axis in range(bench.axes):
        done = [
            (await bench.cycle({axis: bench.point(0.1)} if n == 0 else None)).done
            for n in range(bench.latency + 2)
        ]
        assert [n + 1 for n, out in enumerate(done) if out] == [bench.latency]
    everyone = {axis: bench.point(0.2) for axis in range(bench.axes)}
    done = [
        (await bench.cycle(everyone if n == 0 else None)).done
        for n in range(bench.latency + bench.axes)
    ]
    assert [(n + 1, out[0]) for n, out in enumerate(done) if out] == [
        (bench.latency + axis, axis) for axis in range(bench.axes)
    ]


@cocotb.test()
async def each_axis_gets_what_a_chain_of_its_own_would_give_at_full_load(dut):
    bench = await Bench(dut).begin()
    axes, own = bench.axes, []
    for axis in range(axes):
        outlier = random.choice(((0, 0), (60, 3), (120, 255)))
        settings = draw_settings(bench.w)
        table = [random.randrange(-9000, 9000) for _ in range(POINTS)]
        await bench.cycle(axis=axis, words=dict(outlier=outlier))
        await bench.correct(settings, axis)
        await bench.table(table, axis)
        own.append(OwnChain(bench.w, outlier, settings, table if bench.harmonics else None))
    await bench.cycle()
    speeds = [random.uniform(-0.2, 0.2) for _ in range(axes)]
    want, got = [[] for _ in range(axes)], [[] for _ in range(axes)]
    for n in range(300 if bench.apart == axes else 50):
        new = {}
        for axis in range(axes):
            periods = random.random() if random.random() < 0.03 else n * speeds[axis]
            new[axis] = bench.point(periods)
            want[axis].append(own[axis].sample(*new[axis]))
        for cycle in range(bench.apart):
            out = await bench.cycle(new if cycle == 0 else None)
            assert not out.overrun
            if out.done:
                got[out.done[0]].append(out.done[1:])
    for _ in range(bench.latency + axes):
        out = await bench.cycle()
        if out.done:
            got[out.done[0]].append(out.done[1:])
    assert got == want


@cocotb.test()
async def a_sample_that_comes_too_soon_is_reported(dut):
    bench = await Bench(dut).begin()
    needs(bench.axes > 1, "one axis takes a sample in every cycle")
    sample = bench.point(0.3)
    seen = [await bench.cycle({0: sample, 1: sample} if n < 2 else None) for n in range(4)]
    assert [out.overrun for out in seen] == [0, 1, 0, 0]
    assert [out.lost for out in seen] == [0, 0, 2, 0]


@cocotb.test()
async def a_lost_fringe_shows_at_its_axis_only(dut):
    bench = await Bench(dut).begin()
    last = bench.axes - 1
    for axis in range(bench.axes):
        await bench.cycle(axis=axis, words=dict(limit=32768))
    for n in range(12):  # a quarter period a sample
        bench.counts = [n if axis < last or n < 4 else n - 4 for axis in range(bench.axes)]
        where = {axis: bench.point(0.25 * (n % 4) + 0.01) for axis in range(bench.axes)}
        await bench.cycle(where)
        for _ in range(bench.latency + bench.axes + 3):
            out = await bench.cycle()
        assert out.disagreement == (1 << last if n >= 4 else 0)
    await bench.cycle(learn=bench.everyone)
    await bench.cycle(where)
    for _ in range(bench.latency + bench.axes + 3):
        out = await bench.cycle()
    assert not out.disagreement


@cocotb.test()
async def reset_in_mid_flow_drops_the_samples_and_the_settings(dut):
    bench = await Bench(dut).begin()
    for axis in range(bench.axes):
        await bench.correct(draw_settings(bench.w), axis)
    await bench.cycle({axis: bench.point(0.4) for axis in range(bench.axes)})
    for _ in range(9):
        await bench.cycle()
    await bench.cycle(rst=1)
    for _ in range(bench.latency):
        assert (await bench.cycle()).done is None
    await bench.cycle({0: bench.point(0.125)})
    for _ in range(bench.latency - 1):
        out = await bench.cycle()
    assert abs(out.done[2] - 8192) < 200 and out.done[1] == 0


@cocotb.test()
async def any_input_matches_the_model_in_every_cycle(dut):
    bench = await Bench(dut).begin()
    axes, full = bench.axes, 1 << bench.w - 1
    periods = [0.0] * axes
    for cycle in range(6000):
        new = {}
        for axis in range(axes):
            if random.random() < (0.5 if cycle % 1000 < 100 else 0.8 / axes):
                periods[axis] += random.uniform(-0.3, 0.3)
                bench.counts[axis] = math.floor(4 * periods[axis])
                new[axis] = bench.point(periods[axis])
                if random.random() < 0.02:
                    new[axis] = tuple(random.choice((-full, full - 1, 0)) for _ in "sc")
        words = {}
        if random.random() < 0.2:
            settings = draw_settings(bench.w)
            words = random.choice(
                (
                    dict(outlier=random.choice(((0, 0), (50, 2), (255, 255)))),
                    dict(limit=random.choice((0, 16000, 32768, (1 << 20) - 1))),
                    dict(correction=dict(sin_offset=settings[0], cos_offset=settings[1])),
                    dict(correction=dict(gain=settings.gain)),
                    dict(correction=dict(quadrature_error=settings.quadrature_error)),
                    dict(load=1),
                    dict(point=(random.randrange(POINTS), random.randrange(-1 << 17, 1 << 17))),
                    dict(swap=1),
                )
            )
        enable = random.getrandbits(axes) | random.getrandbits(axes)
        learn = int(random.random() < 0.01) << random.randrange(axes)
        rst = int(random.random() < 0.001)
        await bench.cycle(new, random.randrange(axes), words, enable, learn, rst)


@pytest.mark.parametrize(
    "axes, w, harmonics, cycles",
    [(1, 8, 1, 1), (1, 8, 1, 29), (4, 8, 1, 4), (8, 16, 1, 8), (3, 12, 0, 3)],
)
def test_interpolation_chain(axes, w, harmonics, cycles):
    run(
        "interpolation_chain",
        __file__,
        AXES=axes,
        W=w,
        HAS_HARMONICS=harmonics,
        SAMPLE_CYCLES=cycles,
    )

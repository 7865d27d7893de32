# SPDX-License-Identifier: Apache-2.0
"""Tests of signal_monitor: each fault by its name and at its time, signals that must not cause a
fault, and every cycle against the model.
"""

import random
from dataclasses import asdict

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from tb.bench import run, start
from tb.sense.signal_monitor import FAULTS, Settings, SignalMonitor

ALL = (1 << 13) - 1


def names(bits):
    return [name for n, name in enumerate(FAULTS) if bits >> n & 1]


class Watch:
    """The design and its model; `seen` holds all faults since the start, `rose` the cycle in which
    each rose first.
    """

    def __init__(self, dut, settings):
        self.dut, self.settings, self.model = dut, settings, SignalMonitor()
        self.due, self.now, self.first, self.elapsed, self.seen, self.rose = {}, 0, 0, 0, 0, {}
        self.full = 1 << int(dut.W.value) - 1
        self.latency, self.period = int(dut.W.value) + 24, 2 * int(dut.W.value) + 5

    async def cycle(self, sample=None, phase_jump=0, lost_count=0, clear=0):
        dut, bits = self.dut, 0
        dut.valid.value, dut.clear.value = int(sample is not None), clear
        dut.phase_jump.value, dut.lost_count.value = phase_jump, lost_count
        if sample is not None:
            dut.sin.value, dut.cos.value, dut.a.value, dut.b.value = sample
            bits = int(self.model.sample(*(np.array([x]) for x in sample), self.settings)[0])
            self.due[self.elapsed + self.latency] = bits
        await RisingEdge(dut.clk)
        await FallingEdge(dut.clk)
        self.elapsed += 1
        self.first = self.now if clear or not self.first else self.first
        self.now = self.due.pop(self.elapsed, self.now & ALL) | phase_jump << 13 | lost_count << 14
        self.rose |= {name: self.elapsed for name in names(self.now & ~self.seen)}
        self.seen |= self.now
        got = int(dut.faults.value), int(dut.first.value)
        assert got == (self.now, self.first), (
            f"cycle {self.elapsed}: {names(got[0])}, first {names(got[1])}, the model has "
            f"{names(self.now)}, first {names(self.first)}"
        )

    async def sample(self, cos, sin, a=None, b=None, gap=0):
        cos, sin = (round(min(self.full - 1, max(-self.full, channel))) for channel in (cos, sin))
        await self.cycle(
            (sin, cos, int(cos > 0) if a is None else a, int(sin > 0) if b is None else b)
        )
        await self.rest(self.period - 1 + gap)

    async def turn(
        self, size, fringes=1.0, begin=0.0, steps=60, gap=0, distort=lambda cos, sin: (cos, sin)
    ):
        for n in range(round(abs(fringes) * steps)):
            angle = 2 * np.pi * (begin + np.sign(fringes) * n / steps)
            await self.sample(*distort(size * np.cos(angle), size * np.sin(angle)), gap=gap)

    async def rest(self, cycles):
        """Cycles without an input; those in which nothing may change are passed at once."""
        end = self.elapsed + cycles
        while self.elapsed < end:
            await self.cycle()
            still = min([end, *self.due]) - self.elapsed - 1
            if still > 1:
                await ClockCycles(self.dut.clk, still, FallingEdge)
                self.elapsed += still
                self.first = self.first or self.now

    async def idle(self):
        await self.rest(self.latency)


async def begin(dut, settings=None):
    settings = settings or Settings()
    await start(
        dut,
        valid=0,
        sin=0,
        cos=0,
        a=0,
        b=0,
        phase_jump=0,
        lost_count=0,
        clear=0,
        **asdict(settings),
    )
    return Watch(dut, settings)


def advised(dut, **more):
    width = int(dut.W.value)
    return Settings(**asdict(Settings.advised(0.78 * 2 ** (width - 1), width)) | more)


async def ready(dut, **more):
    """Returns a monitor that has seen a good signal, and the amplitude of that signal."""
    watch = await begin(dut, advised(dut, **more))
    size = 0.78 * watch.full
    await watch.turn(size, 2.25, steps=24)
    await watch.turn(size, -0.25, begin=0.25)
    await watch.idle()
    assert int(dut.ready.value) and not watch.seen
    return watch, size


@cocotb.test()
async def latency_is_w_plus_24_to_every_fault_of_a_sample(dut):
    for name in ("clipped", "jump", "too_high", "off_circle"):
        watch = await begin(dut, Settings(clip_level=110, jump=10, high=120, tolerance=20))
        await watch.turn(90, 2.25, steps=80)
        await watch.idle()
        assert not watch.seen
        # the first sample of a jump, the second sample of the others
        decides = watch.elapsed + watch.period * (name != "jump")
        await watch.sample(0, 126)
        await watch.sample(0, 126)
        await watch.idle()
        assert watch.rose[name] == decides + watch.latency


@cocotb.test()
async def latency_is_1_from_phase_jump_and_lost_count(dut):
    watch = await begin(dut)
    await watch.cycle()
    assert int(dut.faults.value) == 0
    await watch.cycle(phase_jump=1, lost_count=1)
    assert names(int(dut.faults.value)) == ["phase_jump", "lost_count"]


@cocotb.test()
async def latency_is_w_plus_24_to_amplitude(dut):
    watch = await begin(dut)
    await watch.cycle((40, 30, 1, 1))
    for n in range(1, watch.latency + 3):
        assert int(dut.amplitude.value) == (50 if n >= watch.latency else 0)
        await watch.cycle()


@cocotb.test()
async def with_all_checks_off_there_is_no_fault(dut):
    watch = await begin(dut)
    for _ in range(100):
        await watch.sample(
            *(random.uniform(-1.5, 1.5) * watch.full for _ in range(2)),
            a=random.getrandbits(1),
            b=random.getrandbits(1),
        )
    assert not watch.seen


@cocotb.test()
async def a_good_signal_without_noise_raises_nothing_moving_or_at_rest(dut):
    watch, size = await ready(dut)
    for steps in (80, 40, 13, 7, 5, 4.1):
        await watch.turn(size, 2.0, steps=steps)
    for fringe in (0, 3, 10):
        await watch.turn(size, -fringe / 16, steps=90)
        for _ in range(30):
            await watch.sample(
                size * np.cos(fringe / 16 * 2 * np.pi), -size * np.sin(fringe / 16 * 2 * np.pi)
            )
        await watch.turn(size, fringe / 16, begin=-fringe / 16, steps=90)
    assert not watch.seen & ~(1 << FAULTS.index("jump"))


@cocotb.test()
async def a_single_spike_is_only_a_jump(dut):
    watch, size = await ready(dut)
    for n in range(60):
        await watch.sample(size if n != 30 else 0, 0)
    await watch.idle()
    assert names(watch.seen) == ["jump"]


@cocotb.test()
async def each_fault_of_a_moving_signal_has_its_name(dut):
    for name, distort in [
        ("too_low", lambda cos, sin: (0.65 * cos, 0.65 * sin)),
        ("too_high", lambda cos, sin: (1.35 * cos, 0.9 * sin)),
        ("clipped", lambda cos, sin: (1.5 * cos, sin)),
        ("off_circle", lambda cos, sin: (cos, 0.75 * sin)),
        ("channel_stuck", lambda cos, sin: (cos, 5)),
        ("offset_drift", lambda cos, sin: (cos, sin + 0.117 * 2 ** (int(dut.W.value) - 1))),
        ("unbalanced", lambda cos, sin: (1.1 * cos, 0.9 * sin)),
        ("not_in_quadrature", lambda cos, sin: (cos, sin + 0.2 * cos)),
    ]:
        watch, size = await ready(dut)
        await watch.turn(size, 4.0, distort=distort)
        await watch.idle()
        assert name in names(watch.seen), f"{name} is not among {names(watch.seen)}"


@cocotb.test()
async def each_fault_of_a_comparator_or_channel_has_its_name(dut):
    for name, a in [
        ("comparator_mismatch", lambda n: n // 30 % 2),
        ("comparator_stuck", lambda n: 1),
    ]:
        watch, size = await ready(dut)
        for n in range(120):
            angle = 2 * np.pi * n / 60
            await watch.sample(size * np.cos(angle), size * np.sin(angle), a=a(n))
        await watch.idle()
        assert name in names(watch.seen)
    watch, size = await ready(dut)
    for n in range(180):
        angle = 2 * np.pi * (n + 0.5) / 60
        await watch.sample(size, 0, a=int(np.cos(angle) > 0), b=int(np.sin(angle) > 0))
    await watch.idle()
    assert "channel_missing" in names(watch.seen)
    watch, size = await ready(dut, no_noise_samples=50)
    for _ in range(52):
        await watch.sample(size, 0)
    assert names(watch.seen) == ["no_noise"]


@cocotb.test()
async def a_channel_that_opens_at_rest_is_found_at_the_second_sample(dut):
    for fringe in (0.08, 0.1, 0.2, 0.4):  # in periods; the sine goes to zero
        watch, size = await ready(dut)
        await watch.turn(size, fringe, steps=200)
        angle = 2 * np.pi * fringe
        for _ in range(20):
            await watch.sample(size * np.cos(angle), size * np.sin(angle))
        assert not watch.seen
        for _ in range(2):
            await watch.sample(size * np.cos(angle), 0)
        await watch.idle()
        assert "jump" in names(watch.seen) and "off_circle" in names(watch.seen)


@cocotb.test()
async def a_signal_lost_in_both_channels_is_reported_at_the_second_sample_moving_or_at_rest(dut):
    for steps in (4.1, 60, None):  # samples per period; None: at rest
        for fringe in (0.125, 0.77):
            watch, size = await ready(dut)
            await watch.turn(size, fringe, steps=200)
            for n in range(20):
                angle = 2 * np.pi * (fringe + (n / steps if steps else 0))
                await watch.sample(size * np.cos(angle), size * np.sin(angle))
            await watch.idle()
            assert "too_low" not in names(watch.seen)
            second = watch.elapsed + watch.period
            for _ in range(2):
                await watch.sample(0, 0)
            await watch.idle()
            assert watch.rose["too_low"] == second + watch.latency


@cocotb.test()
async def the_first_fault_persists_until_it_is_cleared(dut):
    watch = await begin(dut, Settings(clip_level=10, high=60))
    for _ in range(2):
        await watch.sample(0, 50)
    for _ in range(2):
        await watch.sample(0, 70)
    await watch.idle()
    assert names(int(dut.first.value)) == ["clipped"] and names(int(dut.faults.value)) == [
        "too_high",
        "clipped",
    ]
    await watch.cycle(clear=1)
    assert names(int(dut.first.value)) == ["too_high", "clipped"]
    for _ in range(17):
        await watch.sample(0, 5)
    await watch.idle()
    assert not int(dut.faults.value) and int(dut.first.value)
    await watch.cycle(clear=1)
    assert not int(dut.first.value)


@cocotb.test()
async def reset_in_mid_flow_drops_faults_and_samples(dut):
    watch = await begin(dut, Settings(clip_level=10, high=10))
    for _ in range(12):
        await watch.sample(0, 50)
    assert int(dut.faults.value)
    watch = await begin(dut, Settings(clip_level=10, high=10))
    await watch.idle()
    assert not watch.seen


@cocotb.test()
async def any_signal_in_any_settings_matches_the_model_in_every_cycle(dut):
    for _ in range(6):
        top = (1 << int(dut.W.value) - 1) - 1
        level = lambda top=top: random.choice([0, top // 10, top // 4, top, 65535])
        settings = random.choice(
            [
                advised(dut, no_noise_samples=random.choice([0, 3])),
                Settings(
                    level(),
                    level(),
                    level(),
                    level(),
                    level(),
                    random.choice([0, 3, 255]),
                    level(),
                    random.choice([0, 5]),
                    level(),
                    level(),
                    level(),
                    level(),
                ),
            ]
        )
        watch, angle, speed, channel = await begin(dut, settings), 0.0, 0.05, 0.0
        for n in range(120):
            if n % 40 == 0:
                speed, shrink = (
                    random.choice([0, 0.02, 0.3, 1.5, -0.8]),
                    random.choice([1, 1, 0.3, 1.4]),
                )
                channel = random.choice([1, 1, 1, 0, -1])
            angle += speed
            size = 0.8 * top * shrink + random.gauss(0, 0.5)
            upset = {"a": random.getrandbits(1)} if random.random() < 0.05 else {}
            await watch.sample(size * np.cos(angle), channel * size * np.sin(angle), **upset)
            for _ in range(random.choice([0, 0, 0, 1, 5, 40])):
                await watch.cycle(
                    phase_jump=int(random.random() < 0.02),
                    lost_count=int(random.random() < 0.02),
                    clear=int(random.random() < 0.05),
                )


def test_the_tracker_of_the_campaign_equals_the_model_of_the_module():
    from figures.faults import LOST, Tracker
    from tb.interpolate.fringe_tracker import FringeTracker
    from tb.position.count_phase_check import CountPhaseCheck

    source = np.random.default_rng(1)
    lanes = 20
    many = Tracker(lanes)
    each, checks = (
        [FringeTracker() for _ in range(lanes)],
        [CountPhaseCheck() for _ in range(lanes)],
    )
    phase, count = np.zeros(lanes, np.int64), np.zeros(lanes, np.int64)
    speed = source.integers(-16000, 16000, lanes)
    for _ in range(300):
        outlier = (source.random(lanes) < 0.05) * source.integers(0, 65536, lanes)
        phase = (phase + speed + source.integers(-300, 300, lanes) + outlier) % 65536
        count = count + source.integers(-1, 2, lanes)
        jump, lost = many.follow(phase, count)
        for n in range(lanes):
            step, overspeed = each[n].follow(int(phase[n]))
            for valid in (1, 0, 0):
                disagrees = checks[n].step(0, valid, 0, step, int(count[n]), LOST)
            assert (overspeed, disagrees) == (int(jump[n]), int(lost[n]))


@pytest.mark.parametrize("w", [8, 16])
def test_signal_monitor(w):
    run("signal_monitor", __file__, W=w)

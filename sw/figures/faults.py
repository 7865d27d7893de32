# SPDX-License-Identifier: Apache-2.0
"""Figures of the signal monitor: thousands of injected signal faults, and how many of them the
Verilated signal_monitor finds in time.

A signal has an amplitude of 100 of 128 +-3 % that swells slowly by +-2 % more, offsets up to 5 %,
a gain error up to 6 %, a phase error up to 4 degrees, signed harmonics (+3 1 %, -3 0.6 %, +2 0.4 %,
-5 0.3 %), 0.5 LSB rms of noise on each 8-bit code, a vibration of 1/40 period, and comparators
with 3 % hysteresis that are up to a sample early or late. The settings are `advised`.

A campaign has 14 kinds x 7 sizes x 7 (speeds, or drawn signals at standstill) x 14 positions = 9604
faults, each after a few good fringes. Every one of them counts. The detection time starts with the
first sample at which the phase is wrong by more than 1/16 period, the vector is shorter than 60 %
of the amplitude, or a comparator has the wrong level; an ADC that is frozen under a signal at
rest starts it at once. A fault is found if any alarm comes after its onset and in time: within 2
fringes or 16 samples, whichever is longer, while moving; at standstill within 64 samples, or 2048
for an ADC that repeats the same word. At standstill the positions are drawn from those at
which the fault passes 1/16 period: elsewhere it has no effect.

phase_jump and lost_count, which the monitor receives from fringe_tracker and count_phase_check,
come from `Tracker`, a copy of both in numpy that tb/sense compares with their models.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from figures.common import Figure, Quick, bar, console
from figures.signal_faults import (
    AMPLITUDE,
    Array,
    Fault,
    Signals,
    Values,
    kinds,
    settled_shows,
    stack,
    transformed,
    words,
)
from moire.made.bus_tables import SIGNAL_FAULTS
from twin import BuildError
from twin.build import ROOT, simulation

DRIVER = Path(__file__).with_name("faults_run.cpp")
MONITOR = ROOT / "rtl" / "sense" / "signal_monitor.sv"
SETTINGS = (
    "low",
    "high",
    "clip_level",
    "tolerance",
    "jump",
    "band",
    "span",
    "no_noise_samples",
    "sign_threshold",
    "offset_limit",
    "balance_limit",
    "quadrature_limit",
)
FAULTS = [SIGNAL_FAULTS[bit][0] for bit in sorted(SIGNAL_FAULTS)]
PHASE_JUMP, LOST_COUNT = FAULTS.index("phase_jump"), FAULTS.index("lost_count")
SEED = 1
NO_NOISE_SAMPLES = 1024  # the noise is 0.5 LSB
PERIOD, QUARTER = 1 << 16, 1 << 14
LOST = PERIOD  # limit of count_phase_check: two counts, offset, and a sample late at f_sample / 4
SPEEDS = (0.245, 0.15, 0.06, 0.02, 0.005, 0.001, 0.0003)  # fringes per sample
POSITIONS = 14
ONSET = 620  # samples of good signal before a fault
WARM_UP_SPEED = 0.011
BLOCK = 64  # samples that the monitors take at once

Sample = tuple[Array, Array, Array, Array]  # sin, cos, a, b of each lane


def advised(amplitude: float, width: int = 8, no_noise_samples: int = 0) -> dict[str, int]:
    """Settings that docs/signal_faults.md advises for a signal of this amplitude with at most 0.5
    LSB rms of noise.
    """
    part: Callable[[float], int] = lambda percent: round(amplitude * percent / 100)
    return {
        "low": part(70),
        "high": part(130),
        "clip_level": 2 ** (width - 1) - 2,
        "tolerance": part(9),
        "jump": part(13),
        "band": 3,
        "span": part(80),
        "no_noise_samples": no_noise_samples,
        "sign_threshold": part(20),
        "offset_limit": part(12),
        "balance_limit": part(16),
        "quadrature_limit": part(16),
    }


class Comparators:
    """With hysteresis, and the x4 count of what comes of their levels."""

    HYSTERESIS = 3  # LSB

    def __init__(self, v: Array) -> None:
        self.levels, self.count = np.array([v.real > 0, v.imag > 0]), np.zeros(v.shape, np.int64)
        self.number = self.quarter(self.levels)

    @staticmethod
    def quarter(levels: Values) -> Array:
        a, b = levels
        return np.where(b, np.where(a, 0, 1), np.where(a, 3, 2))

    def see(self, v: Array) -> None:
        channels = np.array([v.real, v.imag])
        self.levels = np.where(self.levels, channels > -self.HYSTERESIS, channels > self.HYSTERESIS)

    def decode(self, levels: Values) -> None:
        """quadrature_decoder; an illegal edge counts nothing."""
        number = self.quarter(levels)
        step = (number - self.number) % 4
        self.count += np.where(step == 1, 1, np.where(step == 3, -1, 0))
        self.number = number


class Tracker:
    """fringe_tracker, unwrap and count_phase_check, many side by side."""

    def __init__(self, lanes: int) -> None:
        self.last, self.started = np.zeros(lanes, np.int64), False
        self.speed, self.predicted, self.position, self.constant = (
            np.zeros(lanes, np.int64) for _ in range(4)
        )
        self.was_outlier = np.zeros(lanes, bool)

    @staticmethod
    def wrapped(phase: Array) -> Array:
        return (phase + PERIOD // 2) % PERIOD - PERIOD // 2

    def follow(self, phase: Array, count: Array) -> tuple[Array, Array]:
        """phase_jump, lost_count"""
        if not self.started:
            self.started, self.last, self.position, self.constant = (
                True,
                phase,
                phase,
                phase - count * QUARTER,
            )
            return np.zeros(phase.shape, bool), np.zeros(phase.shape, bool)
        deviation = self.wrapped(phase - self.last - self.predicted)
        step, nearest = self.predicted + deviation, self.wrapped(phase - self.last)
        fits = (step >= -PERIOD) & (step < PERIOD)
        good = fits & (abs(deviation) < QUARTER)
        outlier = fits & ~good & ~self.was_outlier
        lost = ~good & ~outlier
        taken = np.where(lost, nearest, step)
        self.predicted = np.where(
            good,
            np.where(self.was_outlier, self.speed, step),
            np.where(outlier, self.speed - deviation, 0),
        )
        self.speed = np.where(good & ~self.was_outlier, step, np.where(lost, 0, self.speed))
        self.was_outlier, self.last = outlier, phase
        self.position = self.position + taken
        return ~good, abs(self.position - count * QUARTER - self.constant) > LOST


class Monitors:
    """The Verilated signal_monitor, one per lane."""

    def __init__(self, lanes: int, settings: Mapping[str, int]) -> None:
        self.lanes = lanes
        values = [lanes, *(settings[name] for name in SETTINGS)]
        self.process = subprocess.Popen(
            [simulation(DRIVER, MONITOR), *map(str, values)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self.process.stdin is not None and self.process.stdout is not None
        self.samples, self.judged = self.process.stdin, self.process.stdout

    def judge(self, samples: Sequence[Sample]) -> Array:
        """Faults 0 to 12 as bits, (samples, lanes), of (sin, cos, a, b) of each sample and lane."""
        block = np.array(samples).astype(np.uint8).transpose(2, 0, 1)
        self.samples.write(np.uint32(len(samples)).tobytes() + block.tobytes())
        self.samples.flush()
        size = 2 * self.lanes * len(samples)
        answer = self.judged.read(size)
        if len(answer) != size:
            raise BuildError("faults_run has ended early")
        return np.frombuffer(answer, np.uint16).reshape(self.lanes, -1).T.astype(np.int64)

    def __enter__(self) -> Monitors:
        return self

    def __exit__(self, *_: object) -> None:
        self.samples.close()
        self.process.wait()
        self.judged.close()


@dataclass
class Course:
    """What the lanes do: at(n) is the fringe of sample n; they vibrate by so many fringes, so many
    times per sample; at sample `onset` each has its fault. A lane has `wait` samples from the start
    of its detection time, which is the onset itself where at_once.
    """

    at: Callable[[Values], Array]
    onset: int
    wait: Array
    vibration: tuple[Array, Array]
    at_once: bool | Array = False


class Lanes:
    """Signals with faults, sample by sample: what the monitor sees of them, and what is true."""

    def __init__(self, signals: Signals, fault: Fault, course: Course, source: Generator) -> None:
        self.signals, self.fault, self.course, self.source = signals, fault, course, source
        lanes = signals.amplitude.size
        self.tracker = Tracker(lanes)
        self.late = source.uniform(-1, 1, lanes)
        self.beat = source.random(lanes)
        start = signals.at(self.fringe(-self.late))
        self.comparators, self.healthy = Comparators(start), Comparators(start)
        self.last = [np.zeros(lanes, np.int64)] * 2

    def fringe(self, n: Values) -> Array:
        amount, rate = self.course.vibration
        vibration: Array = amount * np.sin(2 * np.pi * (rate * n + self.beat))
        return self.course.at(n) + vibration

    def share(self, n: int) -> Array:
        """How much of the fault is there at sample n."""
        time, since = self.fault.time, n - self.course.onset
        decayed = 1 - np.exp(-max(since, 0) / np.maximum(time, 1e-9))
        return np.where(time > 0, decayed, float(since >= 0))

    def levels(self, n: int, active: bool, share: Array) -> list[Array]:
        """Levels of the comparators with their faults, after both looks of a sample: the decoder
        sees every edge.
        """
        fault = self.fault
        for back in (0.5, 0.0):
            seen = self.signals.at(self.fringe(n - self.late - back))
            self.healthy.see(seen)
            self.comparators.see(transformed(seen, fault.channel, fault.shift, share))
            forced = [
                np.where(active & (stuck >= 0), np.where(stuck == 2, ~level, stuck == 1), level)
                for stuck, level in zip((fault.a, fault.b), self.comparators.levels)
            ]
            self.comparators.decode(forced)
        return forced

    def sample(self, n: int) -> tuple[Sample, Array, Array]:
        """(sin, cos, a, b) of sample n, its phase_jump and lost_count as bits, and whether it
        starts the detection time.
        """
        fault, active, share = self.fault, n >= self.course.onset, self.share(n)
        a, b = self.levels(n, active, share)
        true = self.signals.at(self.fringe(n))
        v = transformed(true, fault.channel, fault.shift, share)
        v = transformed(v, fault.word, fault.word_shift, share)
        rms = np.where(active, np.hypot(0.5, fault.noise), 0.5)
        noise = self.source.normal(0, 1, (2, len(rms))) * rms
        cos, sin = words(v, noise, fault, active, self.last)
        self.last = [np.where(active, old, new) for old, new in zip(self.last, (cos, sin))]
        phase = np.rint(np.arctan2(sin, cos) * PERIOD / (2 * np.pi)).astype(np.int64) % PERIOD
        jump, lost = self.tracker.follow(phase, self.comparators.count)
        error = abs(np.angle((cos + 1j * sin) * true.conj()))
        wrong_level = ((fault.a >= 0) & (a != self.healthy.levels[0])) | (
            (fault.b >= 0) & (b != self.healthy.levels[1])
        )
        short = np.hypot(cos, sin) < 0.6 * AMPLITUDE
        starts = active & ((error > np.pi / 8) | short | wrong_level | self.course.at_once)
        return (sin, cos, a, b), jump << PHASE_JUMP | lost << LOST_COUNT, starts


def watch(
    signals: Signals,
    fault: Fault,
    course: Course,
    settings: Mapping[str, int],
    source: Generator,
    done: Callable[[], None] = lambda: None,
) -> tuple[Array, Array, Array]:
    """Run the lanes until all are decided. Returns the sample at which the detection time of each
    starts and the sample of its first alarm, -1 for none, and the faults seen up to its deadline.

    The monitors take samples in blocks. The generator of the noise is put back to the sample with
    which the last block ends early, so that the length of a block changes no result.
    """
    lanes, (onset, wait) = signals.amplitude.size, (course.onset, course.wait)
    shown = Lanes(signals, fault, course, source)
    started, alarm, names = np.full(lanes, -1), np.full(lanes, -1), np.zeros(lanes, np.int64)
    n = 0
    with Monitors(lanes, settings) as monitors:
        while True:
            block, states = [], []
            for ahead in range(BLOCK):
                block.append(shown.sample(n + ahead))
                states.append(source.bit_generator.state)
            judged = monitors.judge([sample for sample, *_ in block])
            for found, (_, more, starts), state in zip(judged, block, states):
                found = found | more
                started = np.where((started < 0) & starts, n, started)
                alarm = np.where((alarm < 0) & (found != 0), n, alarm)
                n += 1
                over = (started >= 0) & (n > started + wait)
                names |= np.where(over, 0, found)
                decided = (over | (started >= 0) & (alarm >= 0)).all()
                if n > onset and (decided or n > onset + 12 * wait.max()):
                    source.bit_generator.state = state
                    return started, alarm, names
                if n % 100 == 0:
                    done()


# ------------------------------------------------------------------ the campaign


def slow_down(n: Values, speed: float, end: int) -> Values:
    """Fringes covered since sample 0: WARM_UP_SPEED at first, `speed` from sample end - 20 on, an
    even change within 100 samples.
    """
    begin = end - 120
    x = np.clip((n - begin) / 100, 0, 1)
    change = (x * x * x - x * x * x * x / 2) * 100  # integral of 3x^2 - 2x^3
    return WARM_UP_SPEED * n + (speed - WARM_UP_SPEED) * (change + np.maximum(n - begin - 100, 0))


def slowing(begin: Array, direction: Values, speed: float) -> Callable[[Values], Array]:
    """The course of lanes that begin there and slow down to `speed` by the onset."""
    return lambda n: begin + direction * slow_down(n, speed, ONSET)


def report(
    title: str, unit: str, table: Mapping[str, tuple[int, int, float, list[tuple[str, int]]]]
) -> None:
    console.print(
        f"{title}: faults found in time, of those that count; the slowest detection, in {unit}; "
        "the alarms that found most of them"
    )
    for name, (found, counted, worst, alarms) in table.items():
        words = ", ".join(f"{alarm} {count}" for alarm, count in alarms)
        console.print(
            f"  {name:26} {found:4} of {counted:4}, slowest {worst:6.1f}; {words}",
            highlight=False,
            soft_wrap=True,
        )


def percent_found(rows: Sequence[tuple[Array, ...]], title: str, unit: str) -> float:
    """Percent found of all; rows: kind, started, alarm, wait, onset, names, lateness in unit."""
    table, found_all, counted_all = {}, 0, 0
    kind, started, alarm, wait, onset, names, scale = (
        np.concatenate(column) for column in zip(*rows)
    )
    uncounted = int((started < 0).sum())
    for name in dict.fromkeys(kind):
        here = (kind == name) & (started >= 0)
        found = here & (alarm >= onset) & (alarm <= started + wait)
        late = (alarm - started)[found] * scale[found]
        alarms = [(fault, int((names[found] >> n & 1).sum())) for n, fault in enumerate(FAULTS)]
        most = sorted((pair for pair in alarms if pair[1]), key=lambda pair: -pair[1])[:4]
        table[name] = int(found.sum()), int(here.sum()), late.max(initial=0.0), most
        found_all, counted_all = found_all + found.sum(), counted_all + here.sum()
    early = int(((alarm >= 0) & (alarm < onset)).sum())
    report(title, unit, table)
    console.print(
        f"{counted_all} faults, {found_all} found in time; {early} alarms before the fault; "
        f"{uncounted} without an effect"
    )
    return 100 * float(found_all) / (counted_all + uncounted)


def drawn_kinds(source: Generator, times: Sequence[float]) -> dict[str, list[Fault]]:
    """{name: its seven sizes} of a drawn channel and sign."""
    choice: Any = source.integers(4)
    return kinds(choice % 2, choice // 2 * 2 - 1, times)


def fault_detect_moving_pct(
    seed: int = SEED, speeds: Sequence[float] = SPEEDS, positions: int = POSITIONS
) -> float:
    source, rows = np.random.default_rng(seed), []
    settings = advised(AMPLITUDE, no_noise_samples=NO_NOISE_SAMPLES)
    with bar("faults while moving, speed by speed") as progress:
        for speed in progress.track(speeds):
            faults: list[Fault] = []
            names, goal = [], []
            times = [share / speed for share in (0, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0)]
            for size in range(7):
                for position in range(positions):
                    for name, sizes in drawn_kinds(source, times).items():
                        names.append(name)
                        faults.append(sizes[size])
                        goal.append((position + source.random()) / positions)
            lanes = len(faults)
            signals, direction = Signals(lanes, source), source.choice([-1, 1], lanes)
            begin = np.array(goal) - direction * slow_down(ONSET, speed, ONSET)
            course = Course(
                slowing(begin, direction, speed),
                ONSET,
                np.full(lanes, max(2 / speed, 16.0)),
                ((1 / 40) * source.random(lanes), 10 ** source.uniform(-4, -2, lanes)),
            )
            started, alarm, seen = watch(signals, stack(faults), course, settings, source)
            onset, scale = np.full(lanes, ONSET), np.full(lanes, speed)
            rows.append((np.array(names), started, alarm, course.wait, onset, seen, scale))
    return percent_found(rows, "moving", "fringes after the start of the detection time")


def fault_detect_still_pct(seed: int = SEED, signals: int = 7, positions: int = POSITIONS) -> float:
    source, rows = np.random.default_rng(seed), []
    settings = advised(AMPLITUDE, no_noise_samples=NO_NOISE_SAMPLES)
    times = (0, 1, 3, 10, 30, 100, 300)
    faults: list[Fault] = []
    names, goal = [], []
    drawn = Signals(len(kinds(0, 1, times)) * 7 * signals * positions, source)
    for size in range(7):
        for _ in range(signals):
            for position in range(positions):
                for name, sizes in drawn_kinds(source, times).items():
                    shows = settled_shows(sizes[size], drawn.of(len(faults)))
                    share = (position + source.random()) / positions
                    names.append(name)
                    faults.append(sizes[size])
                    goal.append(shows[int(share * shows.size)])
    frozen = stack(faults).frozen.sum(axis=0) > 0
    with bar("faults at standstill, the frozen first") as progress:
        for part in progress.track((frozen, ~frozen)):  # apart: the frozen take much longer
            chosen = np.nonzero(part)[0]
            begin = np.array(goal)[chosen] - slow_down(ONSET, 0.0, ONSET)
            shaken = (1 / 40) * source.random(chosen.size) * (source.random(chosen.size) < 0.5)
            course = Course(
                slowing(begin, 1, 0.0),
                ONSET,
                np.where(frozen[chosen], 2.0 * NO_NOISE_SAMPLES, 64.0),
                (shaken, 10 ** source.uniform(-3, -2, chosen.size)),
                frozen[chosen],
            )
            fault = stack([faults[n] for n in chosen])
            started, alarm, seen = watch(drawn.of(chosen), fault, course, settings, source)
            onset, scale = np.full(chosen.size, ONSET), np.ones(chosen.size)
            kind = np.array(names)[chosen]
            rows.append((kind, started, alarm, course.wait, onset, seen, scale))
    return percent_found(rows, "still", "samples after the start of the detection time")


def fault_false_alarms(seed: int = SEED, lanes: int = 2000, length: int = 5000) -> float:
    """Alarms in lanes x length samples without a fault: at rest anywhere, at any speed up to
    f_sample / 4, sweeps to it and back, small reversals.
    """
    source = np.random.default_rng(seed)
    signals = Signals(lanes, source)
    kind = np.arange(lanes) % 4
    speed = np.where(
        kind == 1, 10 ** source.uniform(-5, np.log10(0.245), lanes), 0.0
    ) * source.choice([-1, 1], lanes)
    begin, turn = source.random(lanes), source.uniform(600, 2500, lanes)
    size = 10 ** source.uniform(-1.5, 1.5, lanes)  # fringes of a reversal
    sweep_length = source.uniform(1500, 4000, lanes)

    def at(n: Values) -> Array:
        still = slow_down(n, 0.0, ONSET)
        constant = np.where(
            abs(speed) <= WARM_UP_SPEED,
            speed * n,
            np.sign(speed) * slow_down(n, abs(speed), ONSET),
        )
        x = np.clip(np.asarray(n) / sweep_length, 0, 1)
        sweep = 0.242 * sweep_length * (x / 2 - np.sin(2 * np.pi * x) / (4 * np.pi))
        swing = np.minimum(size, 0.2 * turn / (2 * np.pi)) * np.sin(
            2 * np.pi * np.asarray(n) / turn
        )
        moved: Array = np.select([kind == 0, kind == 1, kind == 2], [still, constant, sweep], swing)
        return begin + moved

    vibration = (1 / 40) * source.random(lanes), 10 ** source.uniform(-4, -2, lanes)
    settings = advised(AMPLITUDE, no_noise_samples=NO_NOISE_SAMPLES)
    with bar(f"{lanes} signals of {length} good samples") as progress:
        task = progress.add_task("", total=length // 100)
        course = Course(at, length - 1, np.zeros(lanes), vibration)
        _, alarm, seen = watch(
            signals,
            stack([Fault()] * lanes),
            course,
            settings,
            source,
            done=lambda: progress.advance(task),
        )
    for n, name in enumerate(FAULTS):
        if (seen >> n & 1).any():
            console.print(f"{name}: {int((seen >> n & 1).sum())} of {lanes} signals")
    return float((alarm >= 0).sum())


FIGURES = {
    "fault_detect_moving_pct": Figure(
        fault_detect_moving_pct,
        "%",
        "gross signal faults found within 2 fringes or 16 samples while moving, of 9604 into the "
        "Verilated signal_monitor, the settings fitted to the signal",
        ">= 99",
        Quick({"speeds": SPEEDS[:4], "positions": 1}, "392 faults, the four highest speeds"),
        2,
    ),
    "fault_detect_still_pct": Figure(
        fault_detect_still_pct,
        "%",
        "the same at standstill within 64 samples, a frozen ADC within 2048, at positions at "
        "which the fault has an effect",
        ">= 95",
        Quick({"signals": 2, "positions": 1}, "196 faults", ">= 90"),
        2,
    ),
    "fault_false_alarms": Figure(
        fault_false_alarms,
        "alarms",
        "alarms of the same monitor in 10^7 good samples, at rest, moving, sweeping and reversing",
        "0",
        Quick({"lanes": 100, "length": 2500}, "250 000 samples"),
        0,
    ),
}

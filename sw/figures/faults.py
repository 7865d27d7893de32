# SPDX-License-Identifier: Apache-2.0
"""Signal faults, injected by the thousand into the bit-exact model of signal_monitor: how many are
found, and in time.

A signal is the test signal of the house: amplitude 100 of 128 +-3 % and slowly +-2 % more, offsets
up to 5 %, gain error up to 6 %,
phase error up to 4 degrees, signed harmonics +3 1 %, -3 0.6 %, +2 0.4 %, -5 0.3 %, 0.5 LSB rms
noise on each 8-bit code, a
vibration of 1/40 period, comparators with 3 % hysteresis that come up to a sample early or late.
Settings: Settings.advised.

A campaign is 14 kinds x 7 sizes x 7 (speeds, or drawn signals while still) x 14 positions = 9604
faults, each after a few good
fringes. Each of them counts: the clock of its detection starts with the first sample at which the
phase is wrong by more than
1/16 period, the vector is shorter than 60 % of the amplitude, or a comparator has the wrong level;
a converter that stands still
under a standing signal starts it at once. Found is what raises any fault after its onset and before
2 fringes or 16 samples,
whichever is longer, have gone since then (moving), or 64 samples, 2048 for a converter that gives
the same word again and again
(still). While still, the positions are drawn from those at which the fault passes 1/16 period:
elsewhere it shows nothing.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from figures.common import Figure, bar, console
from tb.sense.signal_monitor import FAULTS, Settings, SignalMonitor

SEED = 1
AMPLITUDE = 100
QUIET = 1024  # samples: the noise is 0.5 LSB
PERIOD, QUARTER = 1 << 16, 1 << 14
LOST = PERIOD  # limit of count_phase_check: two counts, offset, and a sample late at f_sample / 4
SPEEDS = (0.245, 0.15, 0.06, 0.02, 0.005, 0.001, 0.0003)  # fringes a sample
POSITIONS = 14
SETTLED = 620  # samples of good signal before a fault
WARM_UP_SPEED = 0.011


class Signals:
    """Drawn signals, one a lane, and what they show at any phase."""

    HARMONICS = ((3, 0.010), (-3, 0.006), (2, 0.004), (-5, 0.003))

    def __init__(self, lanes, source, share=1.0):
        spread = lambda size: source.uniform(-size, size, lanes) * share
        self.amplitude = AMPLITUDE * (1 + spread(0.03))
        self.offset = AMPLITUDE * (spread(0.05) + 1j * spread(0.05))
        self.gain, self.skew = 1 + spread(0.06), spread(np.radians(4))
        self.harmonics = [
            (order, size * share * np.exp(2j * np.pi * source.random(lanes)))
            for order, size in self.HARMONICS
        ]
        self.swell, self.swell_phase = 0.02 * share, 2 * np.pi * source.random(lanes)

    def of(self, lanes):
        """These lanes of it; of one lane, what can be shown at many phases."""
        part = object.__new__(Signals)
        part.amplitude, part.offset, part.gain, part.skew = (
            x[lanes] for x in (self.amplitude, self.offset, self.gain, self.skew)
        )
        part.harmonics = [(order, size[lanes]) for order, size in self.harmonics]
        part.swell, part.swell_phase = self.swell, self.swell_phase[lanes]
        return part

    def at(self, fringe):
        """cos + i sin, in LSB"""
        z = np.exp(2j * np.pi * fringe)
        w = z.conj()
        powers = {2: z * z, 3: z * z * z, -3: w * w * w}
        powers[-5] = powers[-3] * w * w
        v = z + sum(size * powers[order] for order, size in self.harmonics)
        sin = self.gain * (v.imag * np.cos(self.skew) + v.real * np.sin(self.skew))
        swell = 1 + self.swell * np.sin(2 * np.pi * fringe / 50 + self.swell_phase)
        return self.amplitude * swell * (v.real + 1j * sin) + self.offset


@dataclass
class Fault:
    """One fault or arrays of them. A change comes with 1 - exp(-samples since onset / time), at
    once for time 0.
    """

    leg: tuple = (
        1.0,
        0.0,
        0.0,
        1.0,
    )  # at the sensor: cos from cos, cos from sin, sin from cos, sin from sin
    shift: complex = 0  # LSB, added to them
    word: tuple = (1.0, 0.0, 0.0, 1.0)  # the same between comparators and converter
    word_shift: complex = 0
    time: float = 0.0  # samples
    noise: float = 0.0  # LSB rms more, on both legs
    a: int = -1  # comparator: -1 right, 0, 1 stuck, 2 inverted
    b: int = -1
    ones: tuple = (0, 0)  # bits of the straight binary word that are 1: of cos, of sin
    zeros: tuple = (0, 0)
    frozen: tuple = (0, 0)  # the last good word again and again: of cos, of sin


def stack(faults):
    return Fault(
        **{f.name: np.array([getattr(fault, f.name) for fault in faults]).T for f in fields(Fault)}
    )


def transformed(v, matrix, shift, share):
    """v through a matrix and a shift that are there to a share of one."""
    cos = matrix[0] * v.real + matrix[1] * v.imag + shift.real
    sin = matrix[2] * v.real + matrix[3] * v.imag + shift.imag
    return v + share * (cos + 1j * sin - v)


def words(v, noise, fault, active, last):
    """Two's complement codes of the converter: cos, sin."""
    out = []
    for n, leg in enumerate((v.real + noise[0], v.imag + noise[1])):
        code = np.clip(np.rint(leg), -128, 127).astype(np.int64)
        stuck = ((code + 128) | fault.ones[n]) & ~fault.zeros[n]
        stuck = np.where(fault.frozen[n] == 1, last[n], stuck - 128)
        out.append(np.where(active, stuck, code))
    return out


class Comparators:
    """With hysteresis, and the x4 count of what comes of their levels."""

    HYSTERESIS = 3  # LSB

    def __init__(self, v):
        self.levels, self.count = np.array([v.real > 0, v.imag > 0]), np.zeros(v.shape, np.int64)
        self.number = self.quarter(self.levels)

    @staticmethod
    def quarter(levels):
        a, b = levels
        return np.where(b, np.where(a, 0, 1), np.where(a, 3, 2))

    def see(self, v):
        legs = np.array([v.real, v.imag])
        self.levels = np.where(self.levels, legs > -self.HYSTERESIS, legs > self.HYSTERESIS)

    def decode(self, levels):
        """quadrature_decoder; an illegal edge counts nothing."""
        number = self.quarter(levels)
        step = (number - self.number) % 4
        self.count += np.where(step == 1, 1, np.where(step == 3, -1, 0))
        self.number = number


class Tracker:
    """fringe_tracker, unwrap and count_phase_check, many side by side."""

    def __init__(self, lanes):
        self.last, self.started = np.zeros(lanes, np.int64), False
        self.speed, self.foreseen, self.position, self.constant = (
            np.zeros(lanes, np.int64) for _ in range(4)
        )
        self.strayed = np.zeros(lanes, bool)

    @staticmethod
    def wrapped(phase):
        return (phase + PERIOD // 2) % PERIOD - PERIOD // 2

    def follow(self, phase, count):
        """phase_jump, lost_count"""
        if not self.started:
            self.started, self.last, self.position, self.constant = (
                True,
                phase,
                phase,
                phase - count * QUARTER,
            )
            return np.zeros(phase.shape, bool), np.zeros(phase.shape, bool)
        deviation = self.wrapped(phase - self.last - self.foreseen)
        step, nearest = self.foreseen + deviation, self.wrapped(phase - self.last)
        fits = (step >= -PERIOD) & (step < PERIOD)
        good = fits & (abs(deviation) < QUARTER)
        stray = fits & ~good & ~self.strayed
        lost = ~good & ~stray
        taken = np.where(lost, nearest, step)
        self.foreseen = np.where(
            good,
            np.where(self.strayed, self.speed, step),
            np.where(stray, self.speed - deviation, 0),
        )
        self.speed = np.where(good & ~self.strayed, step, np.where(lost, 0, self.speed))
        self.strayed, self.last = stray, phase
        self.position = self.position + taken
        return ~good, abs(self.position - count * QUARTER - self.constant) > LOST


def watch(
    signals, way, onset, fault, settings, source, wait, tremble, at_once=False, done=lambda: None
):
    """Run the lanes until all are decided.

    way(n) is the fringe of sample n, any n; onset: sample of the fault; wait: samples a lane has
    after the clock of its detection
    starts, which is the onset itself where at_once. tremble: amplitude in fringes and its frequency
    per sample.
    Returns the sample of that start and of the first alarm, -1 for none, and the faults seen up to
    the deadline.
    """
    lanes = signals.amplitude.size
    monitor, tracker = SignalMonitor(lanes), Tracker(lanes)
    late = source.uniform(-1, 1, lanes)
    amount, rate = tremble
    beat = source.random(lanes)
    fringe = lambda n: way(n) + amount * np.sin(2 * np.pi * (rate * n + beat))
    started, alarm, names = np.full(lanes, -1), np.full(lanes, -1), np.zeros(lanes, np.int64)
    comparators, healthy = (Comparators(signals.at(fringe(-late))) for _ in range(2))
    last, n = [np.zeros(lanes, np.int64)] * 2, 0
    share_at = lambda n: np.where(
        fault.time > 0,
        1 - np.exp(-max(n - onset, 0) / np.maximum(fault.time, 1e-9)),
        float(n >= onset),
    )
    while True:
        active, share = n >= onset, share_at(n)
        for back in (0.5, 0.0):  # twice a sample: the decoder sees every edge
            seen = signals.at(fringe(n - late - back))
            healthy.see(seen)
            comparators.see(transformed(seen, fault.leg, fault.shift, share))
            forced = [
                np.where(active & (stuck >= 0), np.where(stuck == 2, ~level, stuck == 1), level)
                for stuck, level in zip((fault.a, fault.b), comparators.levels)
            ]
            comparators.decode(forced)
        true = signals.at(fringe(n))
        v = transformed(true, fault.leg, fault.shift, share)
        v = transformed(v, fault.word, fault.word_shift, share)
        noise = source.normal(0, 1, (2, lanes)) * np.where(active, np.hypot(0.5, fault.noise), 0.5)
        cos, sin = words(v, noise, fault, active, last)
        last = [np.where(active, before, now) for before, now in zip(last, (cos, sin))]
        phase = np.rint(np.arctan2(sin, cos) * PERIOD / (2 * np.pi)).astype(np.int64) % PERIOD
        found = monitor.sample(
            sin, cos, forced[0].astype(np.int64), forced[1].astype(np.int64), settings
        )
        jump, lost = tracker.follow(phase, comparators.count)
        found = found | jump << FAULTS.index("phase_jump") | lost << FAULTS.index("lost_count")

        error = abs(np.angle((cos + 1j * sin) * true.conj()))
        wrong_level = ((fault.a >= 0) & (forced[0] != healthy.levels[0])) | (
            (fault.b >= 0) & (forced[1] != healthy.levels[1])
        )
        counts = active & (
            (error > np.pi / 8) | (np.hypot(cos, sin) < 0.6 * AMPLITUDE) | wrong_level | at_once
        )
        started = np.where((started < 0) & counts, n, started)
        alarm = np.where((alarm < 0) & (found != 0), n, alarm)
        n += 1
        over = (started >= 0) & (n > started + wait)
        names |= np.where(over, 0, found)
        if n > onset and (
            (over | (started >= 0) & (alarm >= 0)).all() or n > onset + 12 * wait.max()
        ):
            return started, alarm, names
        if n % 100 == 0:
            done()


# ---- the campaign
# ----------------------------------------------------------------------------------------------------------


def of_leg(leg, gain, value=0.0):
    """A sensor fault of one leg (0 cos, 1 sin): its gain, and what is added."""
    matrix = (gain, 0.0, 0.0, 1.0) if leg == 0 else (1.0, 0.0, 0.0, gain)
    return {"leg": matrix, "shift": value if leg == 0 else 1j * value}


def word_of(*matrix):
    return Fault(word=tuple(map(float, matrix)))


def phase_error(leg, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return Fault(leg=(c, s, 0.0, 1.0) if leg == 0 else (1.0, 0.0, s, c))


def kinds(leg, up, times):
    """{name: its seven sizes}; leg 0 or 1, up +1 or -1, times: seven times of decay, in samples."""
    stuck = lambda value: Fault(**of_leg(leg, 0.0, value))
    bit = lambda number, one: Fault(
        **{"ones" if one else "zeros": tuple((1 << number) * (n == leg) for n in (0, 1))}
    )
    return {
        "open leg, to mid-scale": [Fault(**of_leg(leg, 0.0), time=t) for t in times],
        "open leg, to the rail": [Fault(**of_leg(leg, 0.0, 140.0 * up), time=t) for t in times],
        "stuck leg": [stuck(v) for v in (-90.0, -60.0, -30.0, 15.0, 45.0, 75.0, 100.0)],
        "short to rail": [
            Fault(word=m, word_shift=s)
            for m, s in [
                ((0.0, 0.0, 0.0, 1.0), 200),
                ((0.0, 0.0, 0.0, 1.0), -200),
                ((1.0, 0.0, 0.0, 0.0), 200j),
                ((1.0, 0.0, 0.0, 0.0), -200j),
                ((0.0, 0.0, 0.0, 0.0), 200 + 200j),
                ((0.0, 0.0, 0.0, 0.0), -200 - 200j),
                ((0.0, 0.0, 0.0, 0.0), 200 - 200j),
            ]
        ],
        "offset": [
            Fault(**of_leg(leg, 1.0, up * v), time=t)
            for v, t in [
                (45.0, 0.0),
                (55.0, 0.0),
                (70.0, 0.0),
                (100.0, 0.0),
                (60.0, times[2]),
                (60.0, times[4]),
                (60.0, times[6]),
            ]
        ],
        "both legs weak": [
            Fault(leg=(g, 0.0, 0.0, g), time=t)
            for g, t in [
                (0.5, 0.0),
                (0.4, 0.0),
                (0.3, 0.0),
                (0.15, 0.0),
                (0.4, times[3]),
                (0.3, times[5]),
                (0.2, times[6]),
            ]
        ],
        "one leg weak or strong": [
            Fault(**of_leg(leg, g)) for g in (0.42, 0.35, 0.25, 0.15, 0.05, 2.6, 4.0)
        ],
        "phase error": [
            phase_error(leg, up * d) for d in (26.0, 32.0, 38.0, 45.0, 55.0, 70.0, 90.0)
        ],
        "mixed-up channels": [
            word_of(0, 1, 1, 0),
            word_of(0, -1, -1, 0),
            word_of(0, 1, 0, 1),
            word_of(1, 0, 1, 0),
            word_of(-1, 0, 0, 1),
            word_of(1, 0, 0, -1),
            word_of(-1, 0, 0, -1),
        ],
        "stuck comparator": [
            Fault(a=0),
            Fault(a=1),
            Fault(b=0),
            Fault(b=1),
            Fault(a=0, b=0),
            Fault(a=1, b=1),
            Fault(a=2) if leg == 0 else Fault(b=2),
        ],
        "cut cable": [Fault(leg=(0.0, 0.0, 0.0, 0.0), time=t) for t in times],
        "dead converter": [
            Fault(zeros=(255, 255)),
            Fault(ones=(255, 255)),
            Fault(ones=(128, 128), zeros=(127, 127)),
            Fault(frozen=(1, 1)),
            Fault(frozen=(1, 0)),
            Fault(frozen=(0, 1)),
            Fault(zeros=(255, 0) if leg == 0 else (0, 255)),
        ],
        "stuck bit": [
            bit(7, 0),
            bit(7, 1),
            bit(6, 0),
            bit(6, 1),
            Fault(zeros=(64, 64)),
            Fault(ones=(64, 64)),
            Fault(ones=(128, 128)),
        ],
        "noise burst": [Fault(noise=s) for s in (20.0, 25.0, 32.0, 45.0, 60.0, 80.0, 120.0)],
    }


def settled_shows(fault, signals):
    """At which of 1440 phases a fault that has come to its end counts, its signal standing there
    without noise.
    """
    fringe = np.arange(1440) / 1440
    true = signals.at(fringe)
    v = transformed(
        transformed(true, fault.leg, complex(fault.shift), 1.0),
        fault.word,
        complex(fault.word_shift),
        1.0,
    )
    if fault.noise or any(fault.frozen):
        return fringe
    many = replace(fault, frozen=(0, 0))
    cos, sin = words(v, (0.0, 0.0), many, True, (0, 0))
    shows = (abs(np.angle((cos + 1j * sin) * true.conj())) > np.pi / 8 + 0.01) | (
        np.hypot(cos, sin) < 0.58 * AMPLITUDE
    )
    for stuck, leg in ((fault.a, true.real), (fault.b, true.imag)):
        if stuck >= 0:
            wrong = np.full(leg.shape, True) if stuck == 2 else (leg > 0) != stuck
            shows |= wrong & (abs(leg) > np.sin(np.pi / 8) * AMPLITUDE)
    return fringe[shows]


def slow_down(n, speed, end):
    """Fringes covered since sample 0: WARM_UP_SPEED at first, `speed` from sample end - 20 on, an
    even change within 100 samples.
    """
    begin = end - 120
    x = np.clip((n - begin) / 100, 0, 1)
    change = (x * x * x - x * x * x * x / 2) * 100  # integral of 3x^2 - 2x^3
    return WARM_UP_SPEED * n + (speed - WARM_UP_SPEED) * (change + np.maximum(n - begin - 100, 0))


def report(title, table, late):
    console.print(
        f"{title}: found in time of those that count; slowest in {late}; the faults that tell most of them"
    )
    for name, (found, counted, worst, names) in table.items():
        told = ", ".join(f"{fault} {count}" for fault, count in names)
        console.print(
            f"  {name:22} {found:4} of {counted:4}, slowest {worst:6.1f}; {told}",
            highlight=False,
            soft_wrap=True,
        )


def verdict(rows, title, unit):
    """Percent found of all; rows: kind, started, alarm, deadline, onset, names, lateness in unit."""
    table, found_all, counted_all = {}, 0, 0
    kind, started, alarm, wait, onset, names, scale = (
        np.concatenate(column) for column in zip(*rows)
    )
    uncounted = int((started < 0).sum())
    for name in dict.fromkeys(kind):
        here = (kind == name) & (started >= 0)
        found = here & (alarm >= onset) & (alarm <= started + wait)
        late = (alarm - started)[found] * scale[found]
        told = [(fault, int((names[found] >> n & 1).sum())) for n, fault in enumerate(FAULTS)]
        table[name] = (
            int(found.sum()),
            int(here.sum()),
            late.max(initial=0.0),
            sorted((t for t in told if t[1]), key=lambda t: -t[1])[:4],
        )
        found_all, counted_all = found_all + found.sum(), counted_all + here.sum()
    early = int(((alarm >= 0) & (alarm < onset)).sum())
    report(title, table, unit)
    console.print(
        f"{counted_all} faults, {found_all} found in time; {early} alarms before the fault; {uncounted} never counted"
    )
    return 100 * float(found_all) / (counted_all + uncounted)


def fault_detect_moving_pct(seed=SEED, **changed):
    source, rows = np.random.default_rng(seed), []
    settings = replace(Settings.advised(AMPLITUDE, quiet=QUIET), **changed)
    with bar("9604 faults while moving, speed by speed") as progress:
        task = progress.add_task("", total=len(SPEEDS))
        for speed in SPEEDS:
            faults, names, goal = [], [], []
            times = [share / speed for share in (0, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0)]
            for size in range(7):
                for position in range(POSITIONS):
                    choice = source.integers(4)
                    for name, sizes in kinds(choice % 2, choice // 2 * 2 - 1, times).items():
                        names.append(name)
                        faults.append(sizes[size])
                        goal.append((position + source.random()) / POSITIONS)
            lanes = len(faults)
            signals, direction = Signals(lanes, source), source.choice([-1, 1], lanes)
            begin = np.array(goal) - direction * slow_down(SETTLED, speed, SETTLED)
            way = lambda n, begin=begin, direction=direction, speed=speed: (
                begin + direction * slow_down(n, speed, SETTLED)
            )
            wait = np.full(lanes, max(2 / speed, 16.0))
            tremble = (1 / 40) * source.random(lanes), 10 ** source.uniform(-4, -2, lanes)
            started, alarm, told = watch(
                signals, way, SETTLED, stack(faults), settings, source, wait, tremble
            )
            progress.advance(task)
            rows.append(
                (
                    np.array(names),
                    started,
                    alarm,
                    wait,
                    np.full(lanes, SETTLED),
                    told,
                    np.full(lanes, speed),
                )
            )
    return verdict(rows, "moving", "fringes after the start of its clock")


def fault_detect_still_pct(seed=SEED, **changed):
    source, rows = np.random.default_rng(seed), []
    settings = replace(Settings.advised(AMPLITUDE, quiet=QUIET), **changed)
    times = (0, 1, 3, 10, 30, 100, 300)
    with bar("9604 faults while still, the frozen first") as progress:
        task = progress.add_task("", total=2)
        faults, names, goal = [], [], []
        lanes = len(kinds(0, 1, times)) * 7 * 7 * POSITIONS
        signals = Signals(lanes, source)
        for size in range(7):
            for _ in range(7):
                for position in range(POSITIONS):
                    choice = source.integers(4)
                    for name, sizes in kinds(choice % 2, choice // 2 * 2 - 1, times).items():
                        shows = settled_shows(sizes[size], signals.of(len(faults)))
                        names.append(name)
                        faults.append(sizes[size])
                        goal.append(
                            shows[int((position + source.random()) / POSITIONS * shows.size)]
                        )
        everything, kind = stack(faults), np.array(names)
        frozen = everything.frozen.sum(axis=0) > 0
        for part in (frozen, ~frozen):  # apart, for they take much longer
            chosen = np.nonzero(part)[0]
            begin = np.array(goal)[chosen] - slow_down(SETTLED, 0.0, SETTLED)
            wait = np.where(frozen[chosen], 2.0 * QUIET, 64.0)
            tremble = (
                (1 / 40) * source.random(chosen.size) * (source.random(chosen.size) < 0.5),
                10 ** source.uniform(-3, -2, chosen.size),
            )
            started, alarm, told = watch(
                signals.of(chosen),
                lambda n, begin=begin: begin + slow_down(n, 0.0, SETTLED),
                SETTLED,
                stack([faults[n] for n in chosen]),
                settings,
                source,
                wait,
                tremble,
                frozen[chosen],
            )
            progress.advance(task)
            rows.append(
                (
                    kind[chosen],
                    started,
                    alarm,
                    wait,
                    np.full(chosen.size, SETTLED),
                    told,
                    np.ones(chosen.size),
                )
            )
    return verdict(rows, "still", "samples after the start of its clock")


def fault_false_alarms(seed=SEED, **changed):
    """10^7 samples without a fault: at rest anywhere, at any speed up to f_sample / 4, sweeps to it
    and back, small reversals.
    """
    source = np.random.default_rng(seed)
    lanes, length = 2000, 5000
    signals = Signals(lanes, source)
    kind = np.arange(lanes) % 4
    speed = np.where(
        kind == 1, 10 ** source.uniform(-5, np.log10(0.245), lanes), 0.0
    ) * source.choice([-1, 1], lanes)
    begin, turn = source.random(lanes), source.uniform(600, 2500, lanes)
    size = 10 ** source.uniform(-1.5, 1.5, lanes)  # fringes of a reversal
    sweep_length = source.uniform(1500, 4000, lanes)

    def way(n):
        rest = slow_down(n, 0.0, SETTLED)
        constant = np.where(
            abs(speed) <= WARM_UP_SPEED,
            speed * n,
            np.sign(speed) * slow_down(n, abs(speed), SETTLED),
        )
        x = np.clip(np.asarray(n) / sweep_length, 0, 1)
        sweep = 0.242 * sweep_length * (x / 2 - np.sin(2 * np.pi * x) / (4 * np.pi))
        swing = np.minimum(size, 0.2 * turn / (2 * np.pi)) * np.sin(
            2 * np.pi * np.asarray(n) / turn
        )
        return begin + np.select([kind == 0, kind == 1, kind == 2], [rest, constant, sweep], swing)

    tremble = (1 / 40) * source.random(lanes), 10 ** source.uniform(-4, -2, lanes)
    settings = replace(Settings.advised(AMPLITUDE, quiet=QUIET), **changed)
    with bar(f"{lanes} signals of {length} good samples") as progress:
        task = progress.add_task("", total=length // 100)
        fault = stack([Fault()] * lanes)
        _, alarm, told = watch(
            signals,
            way,
            length - 1,
            fault,
            settings,
            source,
            np.zeros(lanes),
            tremble,
            done=lambda: progress.advance(task),
        )
    for n, name in enumerate(FAULTS):
        if (told >> n & 1).any():
            console.print(f"{name}: {int((told >> n & 1).sum())} of {lanes} signals")
    return float((alarm >= 0).sum())


FIGURES = {
    "fault_detect_moving_pct": Figure(
        fault_detect_moving_pct,
        "%",
        "signal faults found within 2 fringes or 16 samples while moving",
        "at least 99 of 9604 faults",
        good=lambda v: v >= 99,
        digits=2,
    ),
    "fault_detect_still_pct": Figure(
        fault_detect_still_pct,
        "%",
        "signal faults found within 64 samples at standstill, a frozen converter within 2048",
        "at least 95 of 9604 faults",
        good=lambda v: v >= 95,
        digits=2,
    ),
    "fault_false_alarms": Figure(
        fault_false_alarms,
        "alarms",
        "alarms in 10 million good samples, at rest, moving, sweeping and reversing",
        "0",
        good=lambda v: v == 0,
        digits=0,
    ),
}

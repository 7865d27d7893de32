# SPDX-License-Identifier: Apache-2.0
"""Drawn signals of sine and cosine, and the 14 kinds of faults that they may have, in seven sizes
each. docs/signal_faults.md describes them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

AMPLITUDE = 100

Array = NDArray[Any]
Values = Any  # numbers, or arrays with one for each lane or fault


class Signals:
    """Drawn signals, one a lane, and what they show at any phase."""

    HARMONICS = ((3, 0.010), (-3, 0.006), (2, 0.004), (-5, 0.003))

    def __init__(self, lanes: int, source: Generator, share: float = 1.0) -> None:
        spread: Callable[[float], Array] = lambda size: source.uniform(-size, size, lanes) * share
        self.amplitude = AMPLITUDE * (1 + spread(0.03))
        self.offset = AMPLITUDE * (spread(0.05) + 1j * spread(0.05))
        self.gain, self.skew = 1 + spread(0.06), spread(np.radians(4))
        self.harmonics = [
            (order, size * share * np.exp(2j * np.pi * source.random(lanes)))
            for order, size in self.HARMONICS
        ]
        self.swell, self.swell_phase = 0.02 * share, 2 * np.pi * source.random(lanes)

    def of(self, lanes: Any) -> Signals:
        """These lanes of it; of one lane, what can be shown at many phases."""
        part = object.__new__(Signals)
        part.amplitude, part.offset, part.gain, part.skew = (
            x[lanes] for x in (self.amplitude, self.offset, self.gain, self.skew)
        )
        part.harmonics = [(order, size[lanes]) for order, size in self.harmonics]
        part.swell, part.swell_phase = self.swell, self.swell_phase[lanes]
        return part

    def at(self, fringe: Array) -> Array:
        """cos + i sin, in LSB"""
        z = np.exp(2j * np.pi * fringe)
        w = z.conj()
        powers = {2: z * z, 3: z * z * z, -3: w * w * w}
        powers[-5] = powers[-3] * w * w
        v = z + sum(size * powers[order] for order, size in self.harmonics)
        sin = self.gain * (v.imag * np.cos(self.skew) + v.real * np.sin(self.skew))
        swell = 1 + self.swell * np.sin(2 * np.pi * fringe / 50 + self.swell_phase)
        shown: Array = self.amplitude * swell * (v.real + 1j * sin) + self.offset
        return shown


@dataclass
class Fault:
    """One fault or arrays of them. A change comes with 1 - exp(-samples since onset / time), at
    once for time 0.
    """

    # at the sensor: cos from cos, cos from sin, sin from cos, sin from sin; LSB, added to them
    channel: Values = (1.0, 0.0, 0.0, 1.0)
    shift: Values = 0
    word: Values = (1.0, 0.0, 0.0, 1.0)  # the same between comparators and ADC
    word_shift: Values = 0
    time: Values = 0.0  # samples
    noise: Values = 0.0  # LSB rms more, on both channels
    a: Values = -1  # comparator: -1 right, 0, 1 stuck, 2 inverted
    b: Values = -1
    ones: Values = (0, 0)  # bits of the straight binary word that are 1: of cos, of sin
    zeros: Values = (0, 0)
    frozen: Values = (0, 0)  # the last good word again and again: of cos, of sin


def stack(faults: Sequence[Fault]) -> Fault:
    return Fault(
        **{f.name: np.array([getattr(fault, f.name) for fault in faults]).T for f in fields(Fault)}
    )


def transformed(v: Array, matrix: Values, shift: Values, share: Values) -> Array:
    """v through a matrix and a shift that are there to a share of one."""
    cos = matrix[0] * v.real + matrix[1] * v.imag + shift.real
    sin = matrix[2] * v.real + matrix[3] * v.imag + shift.imag
    through: Array = v + share * (cos + 1j * sin - v)
    return through


def words(v: Array, noise: Values, fault: Fault, active: bool, last: Values) -> list[Array]:
    """Two's complement codes of the ADC: cos, sin."""
    out = []
    for n, channel in enumerate((v.real + noise[0], v.imag + noise[1])):
        code = np.clip(np.rint(channel), -128, 127).astype(np.int64)
        stuck = ((code + 128) | fault.ones[n]) & ~fault.zeros[n]
        stuck = np.where(fault.frozen[n] == 1, last[n], stuck - 128)
        out.append(np.where(active, stuck, code))
    return out


def of_channel(channel: int, gain: float, value: float = 0.0) -> dict[str, Any]:
    """A sensor fault of one channel (0 cos, 1 sin): its gain, and what is added."""
    matrix = (gain, 0.0, 0.0, 1.0) if channel == 0 else (1.0, 0.0, 0.0, gain)
    return {"channel": matrix, "shift": value if channel == 0 else 1j * value}


def word_of(*matrix: float) -> Fault:
    return Fault(word=tuple(map(float, matrix)))


def phase_error(channel: int, degrees: float) -> Fault:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return Fault(channel=(c, s, 0.0, 1.0) if channel == 0 else (1.0, 0.0, s, c))


def kinds(channel: int, up: int, times: Sequence[float]) -> dict[str, list[Fault]]:
    """{name: its seven sizes}; channel 0, 1; up +1, -1, times: seven decay times in samples."""
    stuck: Callable[[float], Fault] = lambda value: Fault(**of_channel(channel, 0.0, value))
    bit: Callable[[int, int], Fault] = lambda number, one: Fault(
        **{"ones" if one else "zeros": tuple((1 << number) * (n == channel) for n in (0, 1))}
    )
    return {
        "open channel, to mid-scale": [Fault(**of_channel(channel, 0.0), time=t) for t in times],
        "open channel, to the rail": [
            Fault(**of_channel(channel, 0.0, 140.0 * up), time=t) for t in times
        ],
        "stuck channel": [stuck(v) for v in (-90.0, -60.0, -30.0, 15.0, 45.0, 75.0, 100.0)],
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
            Fault(**of_channel(channel, 1.0, up * v), time=t)
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
        "both channels weak": [
            Fault(channel=(g, 0.0, 0.0, g), time=t)
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
        "one channel weak or strong": [
            Fault(**of_channel(channel, g)) for g in (0.42, 0.35, 0.25, 0.15, 0.05, 2.6, 4.0)
        ],
        "phase error": [
            phase_error(channel, up * d) for d in (26.0, 32.0, 38.0, 45.0, 55.0, 70.0, 90.0)
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
            Fault(a=2) if channel == 0 else Fault(b=2),
        ],
        "cut cable": [Fault(channel=(0.0, 0.0, 0.0, 0.0), time=t) for t in times],
        "dead ADC": [
            Fault(zeros=(255, 255)),
            Fault(ones=(255, 255)),
            Fault(ones=(128, 128), zeros=(127, 127)),
            Fault(frozen=(1, 1)),
            Fault(frozen=(1, 0)),
            Fault(frozen=(0, 1)),
            Fault(zeros=(255, 0) if channel == 0 else (0, 255)),
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


def settled_shows(fault: Fault, signals: Signals) -> Array:
    """Those of 1440 phases at which a fault that is fully there counts, with a signal at rest and
    without noise.
    """
    fringe = np.arange(1440) / 1440
    true = signals.at(fringe)
    v = transformed(
        transformed(true, fault.channel, complex(fault.shift), 1.0),
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
    for stuck, channel in ((fault.a, true.real), (fault.b, true.imag)):
        if stuck >= 0:
            wrong = np.full(channel.shape, True) if stuck == 2 else (channel > 0) != stuck
            shows |= wrong & (abs(channel) > np.sin(np.pi / 8) * AMPLITUDE)
    return fringe[shows]

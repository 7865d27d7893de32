# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/signal_monitor.sv does, in integers, for many signals side by side: sample() is one sample of each of them."""
from dataclasses import dataclass

import numpy as np

from tb.sense.circle_monitor import CircleMonitor
from tb.sense.leg_monitor import LegMonitor
from tb.sense.vector_length import vector_length

NEVER = 65535
FAULTS = ("too_low", "too_high", "at_rail", "off_circle", "jump", "frozen", "silent", "opposed", "level_stuck", "leg_missing",
          "offset_drift", "unbalanced", "not_square", "phase_jump", "lost_count")
COUNTS = 16         # samples for which a bad one counts


@dataclass
class Settings:
    """As after reset of the settings: nothing is judged."""
    low: int = 0
    high: int = NEVER
    rail: int = NEVER
    tolerance: int = NEVER
    jump: int = NEVER
    band: int = 0
    span: int = NEVER
    quiet: int = 0
    dead: int = NEVER
    offset_limit: int = NEVER
    balance_limit: int = NEVER
    square_limit: int = NEVER

    @classmethod
    def advised(cls, amplitude, width=8, quiet=0):
        """The settings that docs/signal_faults.md advises for a signal of this amplitude with at most 0.5 LSB rms of noise."""
        part = lambda percent: round(amplitude * percent / 100)
        return cls(low=part(70), high=part(130), rail=2 ** (width - 1) - 2, tolerance=part(9), jump=part(13), band=3, span=part(80),
                   quiet=quiet, dead=part(20), offset_limit=part(12), balance_limit=part(16), square_limit=part(16))


class Twice:
    """A fault that rises at the second bad sample within COUNTS, and falls after COUNTS good ones."""

    def __init__(self, lanes):
        self.left, self.fault = np.zeros(lanes, np.int64), np.zeros(lanes, bool)

    def sample(self, bad):
        self.fault = np.where(bad, self.left > 0, self.fault & (self.left > 1))
        self.left = np.where(bad, COUNTS, np.maximum(self.left - 1, 0))
        return self.fault


class SignalMonitor:
    def __init__(self, lanes=1):
        self.cos, self.sin, self.circle = LegMonitor(lanes), LegMonitor(lanes), CircleMonitor(lanes)
        self.twice = {name: Twice(lanes) for name in ("too_low", "too_high", "at_rail", "off_circle", "opposed")}
        self.last_sin, self.last_cos, self.step = (np.zeros(lanes, np.int64) for _ in range(3))
        self.seen, self.amplitude, self.learnt = 0, np.zeros(lanes, np.int64), np.zeros(lanes, bool)

    def sample(self, sin, cos, a, b, settings):
        """The faults 0 … 12 of this sample as bits; sin, cos, a, b: integer arrays, one element a lane."""
        s = settings
        way = np.maximum(abs(sin - self.last_sin), abs(cos - self.last_cos))
        jumped = (self.seen >= 2) & (s.jump != NEVER) & (way > 2 * self.step + s.jump)
        self.last_sin, self.last_cos, self.step, self.seen = sin, cos, way, self.seen + 1

        legs = zip(self.cos.sample(cos, sin, a, b, s.rail, s.band, s.span, s.quiet, s.dead),
                   self.sin.sample(sin, cos, b, a, s.rail, s.band, s.span, s.quiet, s.dead))
        at_rail, frozen, silent, opposed, level_stuck, leg_missing = (x | y for x, y in legs)

        self.amplitude, axis, quadrant, tilt = vector_length(sin, cos)
        self.learnt, off_circle, drift, unbalanced, skewed = self.circle.sample(
            self.amplitude, axis, quadrant, tilt, s.tolerance, s.offset_limit, s.balance_limit, s.square_limit)

        twice = {name: self.twice[name].sample(bad) for name, bad in [
            ("too_low", self.amplitude < s.low), ("too_high", (s.high != NEVER) & (self.amplitude > s.high)),
            ("at_rail", at_rail), ("off_circle", off_circle), ("opposed", opposed)]}
        flags = dict(twice, jump=jumped, frozen=frozen, silent=silent, level_stuck=level_stuck, leg_missing=leg_missing,
                     offset_drift=drift, unbalanced=unbalanced, not_square=skewed)
        return sum(np.asarray(flags[name], np.int64) << n for n, name in enumerate(FAULTS) if name in flags)

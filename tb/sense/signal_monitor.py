# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/signal_monitor.sv for many signals side by side: sample() processes one sample
of each.
"""

from dataclasses import dataclass

import numpy as np

from figures import faults
from tb.sense.channel_monitor import ChannelMonitor
from tb.sense.lissajous_monitor import LissajousMonitor
from tb.sense.vector_length import vector_length

NEVER = 65535
FAULTS = faults.FAULTS
COUNTS = 16  # samples for which a bad one counts


@dataclass
class Settings:
    """The defaults are the settings after reset: nothing is judged."""

    low: int = 0
    high: int = NEVER
    clip_level: int = NEVER
    tolerance: int = NEVER
    jump: int = NEVER
    band: int = 0
    span: int = NEVER
    no_noise_samples: int = 0
    sign_threshold: int = NEVER
    offset_limit: int = NEVER
    balance_limit: int = NEVER
    quadrature_limit: int = NEVER

    @classmethod
    def advised(cls, amplitude, width=8, no_noise_samples=0):
        return cls(**faults.advised(amplitude, width, no_noise_samples))


class Twice:
    """A fault that rises at the second bad sample within COUNTS, falls after COUNTS good ones."""

    def __init__(self, lanes):
        self.left, self.fault = np.zeros(lanes, np.int64), np.zeros(lanes, bool)

    def sample(self, bad):
        self.fault = np.where(bad, self.left > 0, self.fault & (self.left > 1))
        self.left = np.where(bad, COUNTS, np.maximum(self.left - 1, 0))
        return self.fault


class SignalMonitor:
    def __init__(self, lanes=1):
        self.channels, self.circle = ChannelMonitor(lanes), LissajousMonitor(lanes)
        self.twice = {
            name: Twice(lanes)
            for name in ("too_low", "too_high", "clipped", "off_circle", "comparator_mismatch")
        }
        self.amplitude, self.ready = np.zeros(lanes, np.int64), np.zeros(lanes, bool)

    def sample(self, sin, cos, a, b, settings):
        """Returns the faults 0 … 12 of this sample as bits; sin, cos, a, b are integer arrays with
        one element per signal.
        """
        s = settings
        (
            clipped,
            jumped,
            channel_stuck,
            no_noise,
            comparator_mismatch,
            comparator_stuck,
            channel_missing,
        ) = self.channels.sample(
            sin,
            cos,
            a,
            b,
            s.clip_level,
            s.jump,
            s.band,
            s.span,
            s.no_noise_samples,
            s.sign_threshold,
        )

        self.amplitude, axis, quadrant, tilt = vector_length(sin, cos)
        self.ready, off_circle, drift, unbalanced, skewed = self.circle.sample(
            self.amplitude,
            axis,
            quadrant,
            tilt,
            s.tolerance,
            s.offset_limit,
            s.balance_limit,
            s.quadrature_limit,
        )

        twice = {
            name: self.twice[name].sample(bad)
            for name, bad in [
                ("too_low", self.amplitude < s.low),
                ("too_high", (s.high != NEVER) & (self.amplitude > s.high)),
                ("clipped", clipped),
                ("off_circle", off_circle),
                ("comparator_mismatch", comparator_mismatch),
            ]
        }
        flags = dict(
            twice,
            jump=jumped,
            channel_stuck=channel_stuck,
            no_noise=no_noise,
            comparator_stuck=comparator_stuck,
            channel_missing=channel_missing,
            offset_drift=drift,
            unbalanced=unbalanced,
            not_in_quadrature=skewed,
        )
        return sum(
            np.asarray(flags[name], np.int64) << n for n, name in enumerate(FAULTS) if name in flags
        )

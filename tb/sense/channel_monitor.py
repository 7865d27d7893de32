# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/channel_monitor.sv for many signals side by side: Channel.sample() processes
one sample of one channel of each, ChannelMonitor.sample() one of both channels.
"""

import numpy as np

NEVER = 65535


class Channel:
    def __init__(self, lanes=1):
        zeros = lambda: np.zeros(lanes, np.int64)
        self.started = False
        (
            self.last,
            self.rest,
            self.other_rest,
            self.stayed,
            self.same,
            self.channel_stuck,
            self.recent,
            self.no_noise,
        ) = (zeros() for _ in range(8))
        self.sign, self.sign_before, self.side, self.changes, self.half_periods_seen = (
            zeros() for _ in range(5)
        )
        self.level, self.edge_other = zeros(), zeros()

    def sample(
        self,
        channel,
        other,
        level,
        other_level,
        clip_level,
        band,
        span,
        no_noise_samples,
        sign_threshold,
    ):
        """Returns clipped, channel_stuck, no_noise, comparator_mismatch, comparator_stuck,
        channel_missing.
        """
        size = abs(channel)
        clipped = (clip_level != NEVER) & (size > clip_level)

        at_rest = self.started & (abs(channel - self.rest) <= band)
        far = (span != NEVER) & (abs(other - self.other_rest) > span)
        self.channel_stuck = at_rest & (
            self.channel_stuck | (self.stayed >= 2) & far & (self.recent > 0)
        )
        self.recent = np.where(at_rest, np.where(far, 3, np.maximum(self.recent - 1, 0)), 0)
        self.stayed = np.where(at_rest, np.minimum(self.stayed + 1, 3), 0)
        self.rest, self.other_rest = (
            np.where(at_rest, self.rest, channel),
            np.where(at_rest, self.other_rest, other),
        )

        same_code = (channel == self.last) & self.started
        self.same = np.where(same_code, (self.same + 1) % 65536, 0)
        self.no_noise = (
            same_code & (no_noise_samples != 0) & (self.no_noise | (self.same >= no_noise_samples))
        )

        sign = np.where(size > sign_threshold, np.sign(channel), 0)
        comparator_mismatch = (
            (sign != 0)
            & (sign == self.sign)
            & (sign == self.sign_before)
            & (self.level != (channel > 0))
        )
        crossing = (sign != 0) & (self.side != 0) & (sign != self.side)
        toggled = (level != self.level) & self.started
        self.changes = np.where(toggled, 0, np.minimum(self.changes + crossing, 3))
        half_periods = np.where(
            other_level == self.edge_other, 0, np.minimum(self.half_periods_seen + 1, 3)
        )
        self.half_periods_seen = np.where(
            crossing, 0, np.where(toggled, half_periods, self.half_periods_seen)
        )
        self.edge_other = np.where(toggled, other_level, self.edge_other)
        self.side = np.where(sign != 0, sign, self.side)
        self.sign, self.sign_before, self.level, self.last, self.started = (
            sign,
            self.sign,
            level,
            channel,
            True,
        )
        return (
            clipped,
            self.channel_stuck,
            self.no_noise,
            comparator_mismatch,
            self.changes == 3,
            (self.half_periods_seen == 3) & (self.side != 0),
        )


class ChannelMonitor:
    """Both channels."""

    def __init__(self, lanes=1):
        self.cos, self.sin = Channel(lanes), Channel(lanes)
        self.last_sin, self.last_cos, self.step = (np.zeros(lanes, np.int64) for _ in range(3))
        self.seen = 0

    def sample(
        self,
        sin,
        cos,
        a,
        b,
        clip_level,
        jump,
        band,
        span,
        no_noise_samples,
        sign_threshold,
    ):
        """Returns clipped, jumped, channel_stuck, no_noise, comparator_mismatch, comparator_stuck,
        channel_missing.
        """
        distance = np.maximum(abs(sin - self.last_sin), abs(cos - self.last_cos))
        jumped = (self.seen >= 2) & (jump != NEVER) & (distance > 2 * self.step + jump)
        self.last_sin, self.last_cos, self.step, self.seen = sin, cos, distance, self.seen + 1
        settings = clip_level, band, span, no_noise_samples, sign_threshold
        of_cos, of_sin = (
            self.cos.sample(cos, sin, a, b, *settings),
            self.sin.sample(sin, cos, b, a, *settings),
        )
        clipped, *others = (x | y for x, y in zip(of_cos, of_sin))
        return clipped, jumped, *others

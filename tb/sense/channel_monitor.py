# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/channel_monitor.sv for many signals side by side: sample() processes one
sample of each.
"""

import numpy as np

NEVER = 65535


class ChannelMonitor:
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
        ) = (zeros() for _ in range(7))
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

        self.same = np.where(
            (channel == self.last) & self.started, np.minimum(self.same + 1, 65535), 0
        )
        no_noise = (no_noise_samples != 0) & (self.same >= no_noise_samples)

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
            no_noise,
            comparator_mismatch,
            self.changes == 3,
            (self.half_periods_seen == 3) & (self.side != 0),
        )

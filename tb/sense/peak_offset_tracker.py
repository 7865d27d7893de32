# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/peak_offset_tracker.sv for the samples since reset: sample(sin, cos, enable)
returns the corrected sample.
"""


class Channel:
    """S0, chapter 4.4, with samples from 0 to full; f1, p_max, p_min, s1 have the names of S0."""

    def __init__(self, w):
        self.full, self.f1 = (1 << w) - 1, 0
        self.s1 = self.p_max = self.p_min = None

    def offset(self, s2):
        if self.s1 is not None and not self.f1 and s2 > self.s1:
            self.p_min, self.f1 = self.s1, 1
        elif self.s1 is not None and self.f1 and s2 < self.s1:
            self.p_max, self.f1 = self.s1, 0
        self.s1 = s2
        if self.p_max is None or self.p_min is None:
            return 0
        delta = abs(self.full - self.p_max - self.p_min) // 2
        return delta if self.p_max + self.p_min > self.full else -delta


class PeakOffsetTracker:
    def __init__(self, w=8):
        self.zero, self.channels = 1 << w - 1, (Channel(w), Channel(w))

    def sample(self, sin, cos, enable):
        """Returns (sin_out, cos_out, sin_offset, cos_offset)."""
        offsets = [channel.offset(s + self.zero) for channel, s in zip(self.channels, (sin, cos))]
        out = [
            max(-self.zero, min(self.zero - 1, s - offset if enable else s))
            for s, offset in zip((sin, cos), offsets)
        ]
        return *out, *offsets

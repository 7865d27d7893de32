# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/calibration_recorder.sv: step() advances one cycle."""


class CalibrationRecorder:
    """step() returns (word, full, invalid) after the cycle; word is None while what was read has
    not been written.
    """

    def __init__(self, w=8, depth=1024):
        self.w, self.depth, self.burst, self.word = w, depth, [None] * depth, None
        self.begin()

    def begin(self, recording=False):
        self.recording, self.full, self.invalid = recording, 0, 0
        self.place = self.left = 0
        self.earlier = None

    def value(self, phases, sin, cos, phase):
        """The word that this sample or phase completes; None for the earlier of two phases."""
        if not phases:
            high, low = (channel << 16 - self.w & 0xFFFF for channel in (cos, sin))
        elif self.earlier is None:
            self.earlier = phase
            return None
        else:
            high, low, self.earlier = phase, self.earlier, None
        return high << 16 | low

    def step(
        self,
        start=0,
        phases=0,
        decimation=1,
        sampled=0,
        sin=0,
        cos=0,
        phase_valid=0,
        phase=0,
        disturbed=0,
        read=0,
        rst=0,
    ):
        was_full, value = self.full, None
        if self.recording:
            self.invalid |= disturbed
            if phase_valid if phases else sampled:
                if self.left:
                    self.left -= 1
                else:
                    self.left = max(decimation, 1) - 1
                    value = self.value(phases, sin, cos, phase)
        if value is None:
            self.word = self.burst[self.place]
        else:
            self.burst[self.place] = value
            if self.place == self.depth - 1:
                self.recording, self.full = False, 1
        if value is not None or (was_full and read):
            self.place = (self.place + 1) % self.depth
        if start or rst:
            self.begin(recording=bool(start) and not rst)
        return self.word, self.full, self.invalid

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/calibration_recorder.sv: step() advances one cycle."""


class CalibrationRecorder:
    """step() returns (word, full, invalid) after the cycle; word is None until that address has
    been written.
    """

    def __init__(self, w=8, depth=1024):
        self.w, self.depth, self.burst = w, depth, [None] * depth
        self.begin()

    def begin(self, recording=False):
        self.recording, self.full, self.invalid, self.kept, self.next, self.left, self.earlier = (
            recording,
            0,
            0,
            0,
            0,
            0,
            None,
        )

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
        word, was_full = self.burst[self.next], self.full
        if self.recording:
            self.invalid |= disturbed
            if phase_valid if phases else sampled:
                if self.left:
                    self.left -= 1
                else:
                    shift, self.left = 16 - self.w, max(decimation, 1) - 1
                    if phases and self.earlier is None:
                        self.earlier = phase
                    else:
                        high, low = (
                            (phase, self.earlier)
                            if phases
                            else (cos << shift & 0xFFFF, sin << shift & 0xFFFF)
                        )
                        self.burst[self.kept] = high << 16 | low
                        self.kept, self.earlier = self.kept + 1, None
                    if self.kept == self.depth:
                        self.recording, self.full, self.kept = False, 1, 0
        if was_full and read:
            self.next = (self.next + 1) % self.depth
        if start or rst:
            self.begin(recording=bool(start) and not rst)
        return word, self.full, self.invalid

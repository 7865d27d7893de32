# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/sample_hold.sv: step() advances one cycle and returns (sin, cos, phase)
after it; None before the first one.
"""


class SampleHold:
    def __init__(self):
        self.sample, self.phase = (None, None), None

    def step(self, sampled, sin, cos, tracked, phase):
        if sampled:
            self.sample = sin, cos
        if tracked:
            self.phase = phase
        return *self.sample, self.phase

# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/spike_limiter.sv does to the samples since reset: sample(sin, cos, step, hold) returns what passes."""


class SpikeLimiter:
    def __init__(self):
        self.legs, self.held = None, [0, 0]

    def sample(self, sin, cos, step, hold):
        """(sin_out, cos_out, rejected)"""
        new = [sin, cos]
        if self.legs is None:
            self.legs = list(new)
        rejected = False
        for leg in range(2):
            far = step > 0 and abs(new[leg] - self.legs[leg]) > step
            if far and (hold == 255 or self.held[leg] < hold):
                self.held[leg] = min(255, self.held[leg] + 1)
                rejected = True
            else:
                self.legs[leg], self.held[leg] = new[leg], 0
        return *self.legs, int(rejected)

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/outlier_filter.sv for the samples since reset: sample(sin, cos, step, hold)
returns the filtered sample.
"""


class OutlierFilter:
    def __init__(self):
        self.channels, self.held = None, [0, 0]

    def sample(self, sin, cos, step, hold):
        """Returns (sin_out, cos_out, rejected)."""
        new = [sin, cos]
        if self.channels is None:
            self.channels = list(new)
        rejected = False
        for channel in range(2):
            far = step > 0 and abs(new[channel] - self.channels[channel]) > step
            if far and (hold == 255 or self.held[channel] < hold):
                self.held[channel] = min(255, self.held[channel] + 1)
                rejected = True
            else:
                self.channels[channel], self.held[channel] = new[channel], 0
        return *self.channels, int(rejected)

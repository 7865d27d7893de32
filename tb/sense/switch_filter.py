# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/switch_filter.sv: step(levels, sample, rst) advances one cycle and returns the
filtered levels after it.
"""


class SwitchFilter:
    def __init__(self, switches=2, periods=8, settle=4):
        self.periods, self.settling, self.settle = periods, settle, 0
        self.filtered, self.age = [0] * switches, [0] * switches

    def step(self, levels, sample, rst=0):
        """`levels` is a list, the lowest bit first."""
        for n, level in enumerate(levels):
            if rst or self.settle:
                self.filtered[n] = level
            if level == self.filtered[n]:
                self.age[n] = 0
            elif sample:
                self.age[n] += 1
                if self.age[n] == self.periods:
                    self.filtered[n], self.age[n] = level, 0
        self.settle = self.settling if rst else max(self.settle - 1, 0)
        return list(self.filtered)

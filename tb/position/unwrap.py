# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/unwrap.sv: step() advances one cycle and returns done, position."""


class Unwrap:
    def __init__(self):
        self.position, self.started = 0, False

    def step(self, valid, step, phase, shift_periods):
        if valid:
            self.position += step if self.started else 0
            self.position += phase - self.position % 65536  # 0 where the step leads to the phase
            self.started = True
        self.position += shift_periods << 16
        self.position = (self.position + (1 << 47)) % (1 << 48) - (1 << 47)
        return int(valid), self.position

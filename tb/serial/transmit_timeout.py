# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/transmit_timeout.sv in integers: step(requested, tick, rst) advances one
cycle and returns (driver_enable, expired) after it, with requested unchanged.
"""


class TransmitTimeout:
    def __init__(self, bits=1024):
        self.ticks, self.spent, self.off = 8 * bits, 0, 0

    def step(self, requested, tick, rst=0):
        before = self.off
        if rst or not requested:
            self.spent = self.off = 0
        elif tick and not self.off:
            self.spent += 1
            self.off = int(self.spent == self.ticks)
        return int(requested and not self.off), int(self.off and not before)

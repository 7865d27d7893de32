# SPDX-License-Identifier: Apache-2.0
"""What rtl/serial/driver_cutoff.sv does, in integers: step(wanted, bit_time, rst) is one clk and returns (driver_enable, cut) after it,
wanted unchanged."""


class DriverCutoff:
    def __init__(self, bits=1024):
        self.bits, self.spent, self.off = bits, 0, 0

    def step(self, wanted, bit_time, rst=0):
        cut = 0
        if rst or not wanted:
            self.spent = self.off = 0
        elif not self.off:
            cut = self.off = int(self.spent >= max(bit_time, 128) * self.bits // 16)
            self.spent += 1
        return int(wanted and not self.off), cut

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/transmit_timeout.sv in integers: step(requested, bit_time, rst) advances one
cycle and returns (driver_enable, expired) after it, with requested unchanged.
"""


class TransmitTimeout:
    def __init__(self, bits=1024):
        self.bits, self.spent, self.off = bits, 0, 0

    def step(self, requested, bit_time, rst=0):
        expired = 0
        if rst or not requested:
            self.spent = self.off = 0
        elif not self.off:
            expired = self.off = int(self.spent >= max(bit_time, 128) * self.bits // 16)
            self.spent += 1
        return int(requested and not self.off), expired

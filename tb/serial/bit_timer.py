# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/bit_timer.sv in integers: tick(bit_time) is combinational, step(...) advances
one cycle.
"""


class BitTimer:
    def __init__(self):
        self.count, self.odd = 1, 64

    @staticmethod
    def eighth(bit_time):
        """An eighth of a bit in 1/128 cycle."""
        return bit_time if bit_time >= 128 else bit_time + 128

    def tick(self, bit_time):
        return int(self.count == self.eighth(bit_time) >> 7)

    def step(self, bit_time, restart):
        tick = self.tick(bit_time)
        if restart:
            self.count, self.odd = 1, 64
        elif tick:
            self.odd += bit_time & 127
            self.count, self.odd = 1 - (self.odd >> 7), self.odd & 127
        else:
            self.count = (self.count + 1) % 8192
        return tick

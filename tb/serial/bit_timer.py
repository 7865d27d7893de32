# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/bit_timer.sv in integers: tick(bit_time) is combinational, step(...) advances
one cycle.
"""


class BitTimer:
    def __init__(self, parts=8):
        self.one = 16 * parts  # a cycle, in the unit of a part of a bit
        self.count, self.odd = 1, self.one // 2

    def part(self, bit_time):
        """A part of a bit, of which `one` are a cycle."""
        return bit_time if bit_time >= self.one else bit_time + self.one

    def tick(self, bit_time):
        return int(self.count == self.part(bit_time) // self.one)

    def step(self, bit_time, restart):
        tick = self.tick(bit_time)
        if restart:
            self.count, self.odd = 1, self.one // 2
        elif tick:
            self.odd += bit_time % self.one
            self.count, self.odd = 1 - self.odd // self.one, self.odd % self.one
        else:
            self.count = (self.count + 1) % ((1 << 20) // self.one)
        return tick

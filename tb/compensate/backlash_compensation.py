# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/backlash_compensation.sv: step() advances one cycle, position() is that
of the table; lengths in 2^-16 period.
"""

from tables.microcode.numbers import GIVEN


class BacklashCompensation:
    def __init__(self):
        self.up, self.back, self.take_up = 0, 0, 0

    def position(self, position, motor_side):
        return position - (self.take_up if motor_side else 0)

    def step(self, tick, backlash, take_up_rate, hysteresis, valid, kind, result):
        """Advance one cycle."""
        up = self.up
        if valid and GIVEN[kind] == "target_velocity":
            moved = result if result >= 0 else result + 1
            against = -moved if up else moved
            self.back = max(0, self.back + against)
            if against > 0 and self.back > hysteresis << 8:
                self.up, self.back = 1 - up, 0
        if tick:
            left = (backlash if up else 0) - self.take_up
            most = take_up_rate or abs(left)
            self.take_up += max(-most, min(most, left))

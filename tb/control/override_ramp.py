# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/override_ramp.sv does, in integers: clk(...) is one clk and returns the rate after it."""
from approach_law import decide

FULL = 1 << 32


class OverrideRamp:
    def __init__(self):
        self.rate, self.change = FULL, 0
        self.clear()

    def clear(self):
        self.pace = self.area = self.decided = 0
        self.upward = self.last = self.grow = self.fall = self.arrived = 0

    def clk(self, rst=0, slope=0, curve=0, percent=65536, pause=0, moving=0, tick=0):
        setting = 0 if pause else min(percent, 65536) << 16
        change = slope if curve == 0 or curve > slope else curve
        decided, now = self.decided, (self.upward, self.last, self.grow, self.fall, self.change)
        self.decided = tick and moving
        if tick:
            taken = change if self.pace == 0 else self.change
            turn, *found = decide(taken, slope, self.rate - setting, self.pace, self.upward, self.area)
            self.upward, self.last, self.grow, self.fall = found
            if self.arrived:                            # a rest of one tick before the next ramp
                self.last = self.grow = 0
            self.change = taken
        if decided:
            upward, last, grow, fall, change = now
            pace = self.pace + change if grow else self.pace - change if fall else self.pace
            self.area += pace if grow else -self.pace if fall else 0
            self.pace = pace
            arrived = int(last and self.rate != setting)
            self.rate = setting if last else max(0, min(FULL, self.rate + (pace if upward else -pace)))
            self.arrived = arrived
        if rst or not moving or slope == 0:
            self.rate, self.pace, self.area, self.decided, self.arrived = FULL if rst else setting, 0, 0, 0, 0
        return self.rate

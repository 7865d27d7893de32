# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/link_pll.sv in integers: step(...) advances one cycle and returns the outputs
after it, by NAMES.
"""

NAMES = ("locked", "error", "capture")
GAIN, INTEGRAL = 2**8, 2**18  # an error shifts the next arrival, and the period, by a part of it
RANGE = 512  # cycles, of the correction of every period
FULL, PENALTY, PATIENCE = 63, 3, 16
MASK = (1 << 21) - 1


class LinkPll:
    def __init__(self):
        self.reset()
        self.locked = self.capture = 0

    def reset(self):
        self.phase = self.error = self.trim = self.fraction = 0
        self.runs = self.seen = self.score = self.missed = self.locked = 0

    def outputs(self):
        return self.locked, self.error & MASK, self.capture

    def judge(self, period, arrived):
        """The lock, at the end of a period, in which the arrival of the next one may come."""
        if not self.seen:
            self.missed = (self.missed + 1) % PATIENCE
            if not self.missed and not arrived:
                self.runs = self.locked = 0
            return
        self.missed = 0
        if -(period // 4) <= self.error < period // 4:
            self.locked |= int(self.score == FULL)
            self.score = min(self.score + 1, FULL)
        else:
            self.score = max(self.score - PENALTY, 0)
            self.locked &= int(self.score > 0)

    def finish(self, period, arrived):
        """The end of a period: what the next one begins with, in cycles from its arrival."""
        late = self.error if self.seen else 0
        length = self.trim + self.fraction + late * (INTEGRAL // GAIN)
        self.judge(period, arrived)
        if -RANGE * INTEGRAL <= self.trim + late < RANGE * INTEGRAL:
            self.trim += late
        self.seen = 0
        correction, self.fraction = divmod(length, INTEGRAL)
        return -((period + 1) // 2) - correction

    def step(self, enable, period, lead, arrived, rst=0):
        on = enable and period
        self.capture = int(bool(on) and bool(self.locked) and self.phase == -lead - 1)
        if rst or not on:
            self.reset()
            return self.outputs()
        at, began, running = self.phase, self.seen, self.runs
        self.phase += 1
        if self.phase >= period // 2:
            self.phase = self.finish(period, arrived)
        if arrived and not running:
            self.reset()
            self.runs = self.seen = self.phase = 1
        elif arrived and not began:
            self.error, self.seen = at, 1
        return self.outputs()

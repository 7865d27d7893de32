# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/velocity_estimator.sv does, in integers: step() is one clk and returns the velocity."""


class VelocityEstimator:
    def __init__(self):
        self.last, self.velocity = None, 0

    def step(self, tick, position, shift, shift_periods):
        if tick:
            if self.last is not None:
                moved = (position - self.last + (1 << 47)) % (1 << 48) - (1 << 47)
                self.velocity = max(-1 << 31, min((1 << 31) - 1, moved))
            self.last = position
        if shift and self.last is not None:
            self.last += shift_periods << 16
        return self.velocity

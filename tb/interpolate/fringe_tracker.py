# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/fringe_tracker.sv: step(valid, phase) advances one cycle."""

PERIOD, QUARTER = 1 << 16, 1 << 14


def wrapped(phase):
    """The same phase, from minus half a period to one LSB below half a period."""
    return (phase + PERIOD // 2) % PERIOD - PERIOD // 2


class FringeTracker:
    def __init__(self):
        self.last, self.speed, self.predicted_step, self.outlier, self.moved = None, 0, 0, False, 0

    def follow(self, phase):
        """Process one phase; returns step, overspeed."""
        if self.last is None:
            self.last = phase
            return 0, 0
        deviation = wrapped(phase - self.last - self.predicted_step)
        step, nearest = self.predicted_step + deviation, wrapped(phase - self.last)
        fits, near = -PERIOD <= step < PERIOD, abs(deviation) < QUARTER
        self.last = phase
        if fits and near:
            if not self.outlier:
                self.speed = step
            self.predicted_step, self.outlier = self.speed, False
            return step, 0
        if fits and not self.outlier:
            self.predicted_step, self.outlier = self.speed - deviation, True
            return step, 1
        self.predicted_step = self.speed = 0
        self.outlier = False
        return nearest, 1

    def step(self, valid, phase):
        overspeed = 0
        if valid:
            self.moved, overspeed = self.follow(phase)
        return int(valid), self.moved, overspeed

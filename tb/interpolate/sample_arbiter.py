# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/sample_arbiter.sv: step() advances one cycle."""


class SampleArbiter:
    def __init__(self, axes):
        self.axes, self.waiting = axes, set()

    def step(self, samples, rst=0):
        """`samples` has (is new, sin, cos) of each axis; returns (axis, sin, cos) of the one that
        is served, or None, and the set of axes that lost a sample.
        """
        if rst:
            self.waiting = set()
            return None, set()
        new = {axis for axis, sample in enumerate(samples) if sample[0]}
        lost = new & self.waiting
        self.waiting |= new
        if not self.waiting:
            return None, lost
        axis = min(self.waiting)
        self.waiting.remove(axis)
        return (axis, *samples[axis][1:]), lost

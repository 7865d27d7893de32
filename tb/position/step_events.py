# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/step_events.sv does, in integers: event(...) is what is on the pins now,
clk(...) is one cycle.
"""


class StepEvents:
    def __init__(self, delay):
        self.delay, self.delayed = delay, (0, 0)

    @staticmethod
    def now(valid, step):
        return int(bool(valid and step)), int(step < 0)

    def event(self, valid, step):
        """(stepped, downward)"""
        return self.delayed if self.delay else self.now(valid, step)

    def clk(self, rst, valid, step):
        stepped, downward = self.now(valid, step)
        self.delayed = stepped and not rst, downward

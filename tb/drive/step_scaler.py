# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_scaler.sv in integers: clk(...) advances one cycle and returns
(done, steps) after it.
"""

LATENCY = 49  # cycles from valid to done


class StepScaler:
    def __init__(self):
        self.left = self.steps = self.taken = 0

    def clk(self, rst=0, ratio=0, valid=0, position=0):
        done = 0
        if rst:
            self.left = self.steps = 0
        elif self.left:
            self.left -= 1
            if self.left == 0:
                done, self.steps = 1, (self.taken + 2**47) % 2**48 - 2**47
        elif valid:
            self.left, self.taken = LATENCY - 1, position * ratio >> 32
        return done, self.steps

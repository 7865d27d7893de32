# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/deglitcher.sv: step(stable_cycles, level, rst) advances one cycle and returns
the outputs after it.
"""


class Deglitcher:
    def __init__(self, settle=4):
        self.settling, self.settle, self.filtered, self.age = settle, settle, 0, 0

    def step(self, stable_cycles, level, rst=0):
        rejected = 0
        if rst:
            self.settle, self.age, self.filtered = self.settling, 0, level
        elif self.settle:
            self.settle -= 1
            self.filtered = level
        elif level == self.filtered:
            rejected, self.age = int(self.age > 0), 0
        else:
            self.age += 1
            if self.age >= stable_cycles:
                self.filtered, self.age = level, 0
        return self.filtered, rejected

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/synchroniser.sv: step(d) advances one cycle and returns q after it."""


class Synchroniser:
    def __init__(self, w=1, stages=2, reset=0):
        self.reset = reset % (1 << w)
        self.stages = [self.reset] * stages

    def step(self, d, rst=0):
        self.stages = [self.reset] * len(self.stages) if rst else [d, *self.stages[:-1]]
        return self.stages[-1]

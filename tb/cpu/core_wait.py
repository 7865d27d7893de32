# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/core_wait.sv: step(...) advances one cycle and returns waits after it."""


class CoreWait:
    def __init__(self):
        self.left = 0

    def step(self, start=0, cycles=0, wake=0, rst=0):
        if start:
            self.left = cycles + 1
        elif self.left:
            self.left -= 1
        if wake or rst:
            self.left = 0
        return int(self.left > 0)

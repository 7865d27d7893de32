# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/serial/break_detector.sv in integers: step(rx, rst) advances one cycle and returns
found after it.
"""


class BreakDetector:
    def __init__(self, clk_hz, time_us):
        self.longest, self.low = clk_hz // 1000 * time_us // 1000, 0

    def step(self, rx, rst=0):
        self.low = 0 if rx or rst else self.low + 1
        return int(self.low == self.longest)

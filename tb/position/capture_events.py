# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/capture_events.sv does, in integers: levels(...) is what is on the pins now,
clk(...) is one cycle.
"""


class CaptureEvents:
    def __init__(self, delay):
        self.delayed = [0] * delay

    def levels(self, by_counts, index_found, capture_now, sync):
        """(index, software)"""
        return self.delayed[-1] if by_counts else index_found, int(capture_now or sync)

    def clk(self, rst, index_found):
        empty = [0] * len(self.delayed)
        self.delayed = empty if rst else [index_found, *self.delayed[:-1]]

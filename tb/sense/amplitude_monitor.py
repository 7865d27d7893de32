# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/amplitude_monitor.sv does to the samples since reset, in integers."""

F = 4               # fraction bits
IN_A_ROW = 3        # samples outside before a flag stands


def amplitude(sin, cos):
    x, y = sorted((abs(sin) << F, abs(cos) << F), reverse=True)
    for k in range(1, 5):
        x, y = (x - (y >> k), y + (x >> k)) if y < 0 else (x + (y >> k), y - (x >> k))
    return x - (x >> 3) - (x >> 6) + (1 << F - 1) >> F


class AmplitudeMonitor:
    def __init__(self):
        self.lows = self.highs = 0

    def sample(self, sin, cos, low, high):
        """(amplitude, too_low, too_high)"""
        now = amplitude(sin, cos)
        self.lows = self.lows + 1 if now < low else 0
        self.highs = self.highs + 1 if now > high else 0
        return now, int(self.lows >= IN_A_ROW), int(self.highs >= IN_A_ROW)

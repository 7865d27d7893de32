# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/zero_crossing.sv: step() advances one cycle and returns up, down."""


class ZeroCrossing:
    def __init__(self):
        self.below, self.shifted = None, False

    def step(self, valid, position, shift):
        below, wrap = position < 0, not -1 << 46 <= position < 1 << 46
        crossed = (
            valid
            and self.below is not None
            and not self.shifted
            and not wrap
            and below != self.below
        )
        if valid or self.shifted and self.below is not None:
            self.below = below
        self.shifted = bool(shift)
        return int(crossed and not below), int(crossed and below)

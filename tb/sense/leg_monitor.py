# SPDX-License-Identifier: Apache-2.0
"""What rtl/sense/leg_monitor.sv does, in integers, for many signals side by side: sample() is one sample of each of them."""
import numpy as np

NEVER = 65535


class LegMonitor:
    def __init__(self, lanes=1):
        zeros = lambda: np.zeros(lanes, np.int64)
        self.started = False
        self.last, self.home, self.other_home, self.stood, self.same, self.frozen, self.recent = (zeros() for _ in range(7))
        self.sign, self.sign_before, self.side, self.changes, self.turns = (zeros() for _ in range(5))
        self.level, self.edge_other = zeros(), zeros()

    def sample(self, leg, other, level, other_level, rail, band, span, quiet, dead):
        """at_rail, frozen, silent, opposed, level_stuck, leg_missing"""
        size = abs(leg)
        at_rail = (rail != NEVER) & (size > rail)

        homely = self.started & (abs(leg - self.home) <= band)
        far = (span != NEVER) & (abs(other - self.other_home) > span)
        self.frozen = homely & (self.frozen | (self.stood >= 2) & far & (self.recent > 0))
        self.recent = np.where(homely, np.where(far, 3, np.maximum(self.recent - 1, 0)), 0)
        self.stood = np.where(homely, np.minimum(self.stood + 1, 3), 0)
        self.home, self.other_home = np.where(homely, self.home, leg), np.where(homely, self.other_home, other)

        self.same = np.where((leg == self.last) & self.started, np.minimum(self.same + 1, 65535), 0)
        silent = (quiet != 0) & (self.same >= quiet)

        sign = np.where(size > dead, np.sign(leg), 0)
        opposed = (sign != 0) & (sign == self.sign) & (sign == self.sign_before) & (self.level != (leg > 0))
        crossing = (sign != 0) & (self.side != 0) & (sign != self.side)
        toggled = (level != self.level) & self.started
        self.changes = np.where(toggled, 0, np.minimum(self.changes + crossing, 3))
        turned = np.where(other_level == self.edge_other, 0, np.minimum(self.turns + 1, 3))
        self.turns = np.where(crossing, 0, np.where(toggled, turned, self.turns))
        self.edge_other = np.where(toggled, other_level, self.edge_other)
        self.side = np.where(sign != 0, sign, self.side)
        self.sign, self.sign_before, self.level, self.last, self.started = sign, self.sign, level, leg, True
        return at_rail, self.frozen, silent, opposed, self.changes == 3, (self.turns == 3) & (self.side != 0)

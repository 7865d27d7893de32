# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/count_phase_check.sv: step() advances one cycle and returns disagreement
after it.
"""


def wrapped(difference):
    """Wrap to 46 bits with a sign: the count wraps at 2^32 / 4 periods."""
    return (difference + (1 << 45)) % (1 << 46) - (1 << 45)


class CountPhaseCheck:
    """Two pipeline stages: `between` of the preceding position, then its `difference` from the
    constant.
    """

    def __init__(self):
        self.constant, self.between, self.difference, self.disagreement = None, None, None, 0

    def step(self, limit, valid, position, count, shift, shift_periods):
        moved = shift_periods << 16 if shift else 0
        difference, self.difference = self.difference, None
        if difference is not None:
            self.disagreement = int(abs(difference) > limit)
        if self.between is not None:
            if self.constant is None or not limit:
                self.constant, self.disagreement = self.between, 0
            else:
                self.difference = wrapped(self.between - self.constant)
        if self.constant is not None:
            self.constant += moved
        self.between = wrapped(position - (count << 14)) + moved if valid else None
        if shift and not shift_periods:
            self.constant = None
        if not limit:
            self.disagreement = 0
        return self.disagreement

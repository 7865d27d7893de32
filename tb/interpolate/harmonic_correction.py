# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/harmonic_correction.sv: corrected(phase, table) computes one phase,
HarmonicCorrection.step() advances one cycle.
"""

LATENCY = 4
POINTS = 256


def corrected(phase, table):
    """`table` has POINTS entries of 2^-20 period."""
    point, along = phase >> 8, phase & 255
    here, following = table[point], table[(point + 1) % POINTS]
    return phase - (here * 256 + (following - here) * along + 2048 >> 12) & 65535


class HarmonicCorrection:
    """step() returns (done, phase_out) after the cycle."""

    def __init__(self):
        self.tables = [[0] * POINTS, [0] * POINTS]
        self.reset()

    def reset(self):
        self.page, self.swapped, self.flow, self.out = 0, False, [None] * (LATENCY - 1), 0

    def step(self, valid, phase, enable=1, write=None, swap=0, rst=0):
        """`write` is None or (point, value)."""
        self.page ^= swap
        self.swapped |= bool(swap)
        self.flow.append(
            (corrected(phase, self.tables[self.page]) if enable and self.swapped else phase)
            if valid
            else None
        )
        if write:
            self.tables[self.page ^ 1][write[0]] = write[1]
        if rst:
            self.reset()
            return 0, 0
        ready = self.flow.pop(0)
        self.out = self.out if ready is None else ready
        return int(ready is not None), self.out

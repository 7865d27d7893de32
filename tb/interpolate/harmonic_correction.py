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

    def __init__(self, axes=1):
        self.tables = [[[0] * POINTS, [0] * POINTS] for _ in range(axes)]
        self.reset()

    def reset(self):
        self.page, self.swapped = [0] * len(self.tables), [False] * len(self.tables)
        self.flow, self.out = [None] * (LATENCY - 1), 0
        self.waiting = None  # (table, point, value) of an entry that is not stored yet

    def in_force(self, axis=0):
        return self.tables[axis][self.page[axis]]

    def step(self, valid, phase, enable=1, write=None, swap=0, rst=0, axis=0, table_axis=0):
        """`write` is None or (point, value), `enable` one bit for each axis."""
        self.page[table_axis] ^= swap
        self.swapped[table_axis] |= bool(swap)
        acts = enable >> axis & 1 and self.swapped[axis]
        out = corrected(phase, self.in_force(axis)) if acts else phase
        self.flow.append(out if valid else None)
        if self.waiting and not valid:
            table, point, value = self.waiting
            table[point] = value
            self.waiting = None
        if write:
            self.waiting = self.tables[table_axis][self.page[table_axis] ^ 1], *write
        if rst:
            self.reset()
            return 0, 0
        ready = self.flow.pop(0)
        self.out = self.out if ready is None else ready
        return int(ready is not None), self.out

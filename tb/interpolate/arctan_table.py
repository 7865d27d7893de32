# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/arctan_table.sv: phase_of() computes one sample, ArctanTable.step()
advances one cycle.
"""

from tables import arctan

LATENCY = 23


def phase_of(sin, cos):
    smaller, larger = sorted((abs(sin), abs(cos)))
    index, along = divmod((smaller << arctan.RATIO) // max(larger, 1), 1 << arctan.FRACTION)
    phase = (
        (arctan.BASE[index] << arctan.FRACTION) + arctan.SLOPE[index] * along
    ) >> arctan.GUARD + arctan.FRACTION
    if abs(sin) > abs(cos):
        phase = (1 << 14) - phase
    if cos < 0:
        phase = (1 << 15) - phase
    return (-phase if sin < 0 else phase) % (1 << 16)


class ArctanTable:
    def __init__(self):
        self.left, self.coming, self.phase = 0, 0, 0

    def step(self, valid, sin, cos):
        done = self.left == 1
        if done:
            self.phase = self.coming
        if self.left:
            self.left -= 1
        elif valid:
            self.left, self.coming = LATENCY - 1, phase_of(sin, cos)
        return int(done), self.phase

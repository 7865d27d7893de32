# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/count_to_phase.sv: step() advances one cycle and returns the outputs after
it.
"""

QUARTER = 1 << 14


class CountToPhase:
    def __init__(self):
        self.phase = 0

    def step(self, rst=0, tick=0, count_step=0, align=0, align_counts=0):
        counts = count_step + (align_counts if align else 0)
        self.phase = 0 if rst else (self.phase + counts * QUARTER) % 65536
        return dict(
            valid=int(not rst and (tick or counts != 0)), step=counts * QUARTER, phase=self.phase
        )

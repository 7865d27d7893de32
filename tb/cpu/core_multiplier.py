# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/core_multiplier.sv in integers: step(...) advances one cycle and returns ready
and result after it.
"""

from tb.cpu.core_divider import DISTINCTIVE, DIVISION

MULTIPLICATION = DIVISION & ~(1 << 14)  # what all four codes have in common
MUL, MULH, MULHSU, MULHU = (MULTIPLICATION | n << 12 for n in range(4))


def product(instruction, a, b, w=32):
    """The result of the instruction for two operands of w bits."""
    kind = instruction >> 12 & 3
    if kind in (1, 2) and a >> (w - 1):
        a -= 1 << w
    if kind == 1 and b >> (w - 1):
        b -= 1 << w
    return (a * b >> (w if kind else 0)) & (1 << w) - 1


class CoreMultiplier:
    def __init__(self, w=32):
        self.w, self.busy, self.ready, self.result = w, 0, 0, 0

    def step(self, valid, instruction, a, b, rst=0):
        """The operands stay as they are from valid to ready."""
        if self.busy:
            self.result = product(instruction, a, b, self.w)
        begins = valid and instruction & DISTINCTIVE == MULTIPLICATION
        begins = int(begins and not self.busy and not self.ready)
        self.busy, self.ready = (0, 0) if rst else (begins, self.busy)
        return self.ready, self.result

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/core_divider.sv in integers: step(...) advances one cycle and returns ready and
result after it.
"""

DIVISION = 0b0110011 | 1 << 25 | 1 << 14  # what all four codes have in common
DIV, DIVU, REM, REMU = (DIVISION | n << 12 for n in range(4))
DISTINCTIVE = 0x7F | 0x7F << 25 | 1 << 14  # the bits that tell a division or a product


def is_division(instruction):
    return instruction & DISTINCTIVE == DIVISION


class CoreDivider:
    """Divides the amounts of the operands bit by bit; the quotient takes the place of the
    dividend.
    """

    def __init__(self, w=32):
        self.w, self.mask = w, (1 << w) - 1
        self.busy = self.ready = self.left = self.remainder = self.quotient = self.result = 0

    def negative(self, x, instruction):
        return not instruction >> 12 & 1 and x >> (self.w - 1) & 1

    def amount(self, x, instruction):
        return -x & self.mask if self.negative(x, instruction) else x

    def step(self, valid, instruction, a, b, rst=0):
        of_remainder = instruction >> 13 & 1
        from_zero = self.quotient >> (self.w - 2) == 3
        negative = self.negative(a, instruction)
        if not of_remainder:
            negative = negative != self.negative(b, instruction) and not from_zero
        found = self.remainder if of_remainder else self.quotient
        self.result = (-found if negative else found) & self.mask

        ready = int(self.busy and self.left == 0)
        if not self.busy:
            self.busy = int(valid and is_division(instruction) and not self.ready)
            self.left = self.w
            self.quotient = self.amount(a, instruction)
        elif self.left == 0:
            self.busy = self.remainder = 0
        else:
            wide, divisor = (
                self.remainder << 1 | self.quotient >> (self.w - 1),
                self.amount(b, instruction),
            )
            fits = int(wide >= divisor)
            self.remainder = (wide - divisor if fits else wide) & self.mask
            self.quotient = (self.quotient << 1 | fits) & self.mask
            self.left -= 1
        self.ready = 0 if rst else ready
        if rst:
            self.busy = self.remainder = 0
        return self.ready, self.result

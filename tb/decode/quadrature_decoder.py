# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/decode/quadrature_decoder.sv: step(a, b, mode, clear, rst) advances one cycle and
returns the outputs after it.
"""

QUARTER = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}  # quarter of the period
X4, X2, X1, PULSES = range(4)
# a count border lies after each of these quarters
BORDERS = {X4: {0, 1, 2, 3}, X2: {0, 2}, X1: {0}}


class QuadratureDecoder:
    def __init__(self, w=32, settle=8):
        self.w, self.settling, self.settle, self.a, self.b, self.count, self.upward = (
            w,
            settle,
            0,
            0,
            0,
            0,
            1,
        )

    @property
    def ready(self):
        return int(self.settle == 0)

    def classify(self, a, b, mode=X4):
        """(direction, step of count, illegal) of these levels, whether ready or not."""
        if mode == PULSES:
            rise, change = a and not self.a, b != self.b
            return 1 - b, 0 if change or not rise else 1 - 2 * b, int(rise and change)
        before, moved = QUARTER[self.a, self.b], (QUARTER[a, b] - QUARTER[self.a, self.b]) % 4
        if moved == 1:
            return 1, int(before in BORDERS[mode]), 0
        if moved == 3:
            return 0, -int((before - 1) % 4 in BORDERS[mode]), 0
        return self.upward, 0, int(moved == 2)

    def step(self, a, b, mode=X4, clear=0, rst=0):
        direction, step, illegal = self.classify(a, b, mode)
        if rst or self.settle:
            direction, step, illegal = 1, 0, 0
        self.a, self.b, self.upward = a, b, direction
        self.settle = self.settling if rst else max(self.settle - 1, 0)
        total = 0 if rst or clear else self.count + step
        self.count = (total + (1 << self.w - 1)) % (1 << self.w) - (1 << self.w - 1)
        return self.count, step, illegal

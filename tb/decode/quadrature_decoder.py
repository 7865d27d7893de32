# SPDX-License-Identifier: Apache-2.0
"""What rtl/decode/quadrature_decoder.sv does: step(a, b, rst) is one clk, and returns what is on the pins after it."""

PLACE = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}      # quarter of the period


class QuadratureDecoder:
    def __init__(self, w=32, settle=8):
        self.w, self.settling, self.settle, self.place, self.count = w, settle, settle, 0, 0

    def step(self, a, b, rst=0):
        moved = (PLACE[a, b] - self.place) % 4
        self.place = PLACE[a, b]
        if rst:
            self.settle, self.count = self.settling, 0
            return 0, 0, 0
        if self.settle:
            self.settle -= 1
            moved = 0
        step = {0: 0, 1: 1, 2: 0, 3: -1}[moved]
        self.count = (self.count + step + (1 << self.w - 1)) % (1 << self.w) - (1 << self.w - 1)
        return self.count, step, int(moved == 2)

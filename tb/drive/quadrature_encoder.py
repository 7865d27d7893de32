# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/quadrature_encoder.sv in integers: clk(...) advances one cycle; pins() and the
attributes hold the state after it.
"""


def signed(value, bits):
    value &= (1 << bits) - 1
    return value - (value >> bits - 1 << bits)


class QuadratureEncoder:
    def __init__(self, w=32, f=16):
        self.w, self.f = w, f
        self.position = 0  # wraps at 2^w
        self.goal = None  # (target, half a band) of the cycle before
        self.left = 0
        self.from_mark = None  # counts from the reference mark up
        self.waiting = None  # home_position that is not taken yet
        self.turn = self.highest = 0  # highest: of place, of the cycle before
        self.far = self.behind = False  # far: value of behind in the next cycle

    def pins(self):
        b = self.position >> 1 & 1
        return b ^ self.position & 1, b, int(self.from_mark == 0 and self.turn != 0)

    def clk(
        self,
        rst=0,
        minimum_edge_separation=0,
        hysteresis=0,
        counts_per_turn=0,
        load=0,
        target=0,
        home=0,
        home_position=0,
    ):
        self.turn = counts_per_turn
        if rst:
            self.__init__(self.w, self.f)
            self.turn, self.highest = counts_per_turn, (counts_per_turn - 1) % (1 << self.w)
            return
        whole = 1 << self.w
        self.behind, self.far = self.far, False
        up = down = False
        if self.goal:
            aimed_at, band = self.goal
            ahead = signed((aimed_at - band >> self.f) - self.position, self.w)
            back = signed((aimed_at + band >> self.f) - self.position, self.w)
            self.far = ahead >= 4 or back < -4
            if self.left == 0 and not load:
                up, down = ahead >= 0, ahead < 0 and back < 0
        if self.waiting is not None and not up and not down:
            distance = signed(self.position - self.waiting, self.w)
            self.from_mark = (distance + (counts_per_turn if distance < 0 else 0)) % whole
            self.waiting = None
        elif self.from_mark is not None and up:
            self.from_mark = 0 if self.from_mark == self.highest else (self.from_mark + 1) % whole
        elif self.from_mark is not None and down:
            self.from_mark = self.from_mark - 1 if self.from_mark else self.highest
        self.highest = (counts_per_turn - 1) % whole
        if home:
            self.waiting = home_position
        self.left = max(0, minimum_edge_separation - 1) if up or down else max(0, self.left - 1)
        self.position = home_position if load else (self.position + up - down) % whole
        self.goal = None if load else (target, (1 << self.f - 1) + hysteresis)

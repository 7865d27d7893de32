# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/turn_angle.sv in integers: clk(...) advances one cycle; the attributes
hold the state after it.
"""


class TurnAngle:
    def __init__(self, w=32):
        self.w = w
        self.position = self.from_mark = self.turned = self.turns = 0
        self.highest = 0  # of from_mark, of the cycle before
        self.moved = self.known = self.referenced = self.missing = False

    @property
    def angle(self):
        return self.turned >> 16

    def clk(self, rst=0, counts_per_turn=0, angle_per_count=0, a=0, b=0, step=0, index=0):
        used, known, highest = counts_per_turn != 0, self.known, self.highest
        self.highest = (counts_per_turn - 1) % (1 << self.w)
        if rst or not (self.moved or step):
            self.__init__(self.w)
            self.highest = (counts_per_turn - 1) % (1 << self.w)
            self.position = b << 1 | a ^ b
            self.known = used and not rst and (known or bool(index))
            self.referenced = bool(index and used and not rst)
            return
        self.moved = True
        self.position = (self.position + step) % (1 << self.w)
        self.referenced, self.missing = bool(index and used), False
        self.known = used and (known or bool(index))
        if index:
            self.from_mark = self.turned = self.turns = 0
            return
        from_mark = self.from_mark + step
        passed = -1 if from_mark < 0 else step > 0 and (self.from_mark >= highest or not used)
        self.from_mark = 0 if not used else 0 if passed == 1 else highest if passed else from_mark
        self.turned = (self.turned + step * angle_per_count) % (1 << 48)
        if passed == 1 or (step < 0 and self.from_mark == 0 and not passed):
            self.turned = 0
        self.turns += passed
        if self.turns in (1, -2):
            self.turns, self.missing = 0, used

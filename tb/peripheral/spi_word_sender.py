# SPDX-License-Identifier: Apache-2.0
"""Integer model of rtl/peripheral/spi_word_sender.sv: step(...) is one cycle and returns
(ready, cs_n, sclk, sdi, sent) after it.
"""

BITS, RAISE, HALVES = 16, 33, 36  # half periods of sclk in a word: before cs_n rises; in all


class SpiWordSender:
    def __init__(self):
        self.word, self.age = 0, None  # age: cycles since the word was taken, None: ready

    def step(self, valid, word, half_period, rst=0):
        if rst:
            self.__init__()
        elif self.age is not None:
            self.age += 1
            if self.age == HALVES * self.length:
                self.age = None
        elif valid:
            self.word, self.length, self.age = word, max(half_period, 1), 0
        return self.pins()

    def pins(self):
        if self.age is None:
            return 1, 1, 0, self.word & 1, 0
        half, remainder = divmod(self.age, self.length)
        sdi = self.word >> BITS - 1 - min(half // 2, BITS - 1) & 1
        return (
            0,
            int(half >= RAISE),
            int(half % 2 and half < RAISE),
            sdi,
            int(half == RAISE and remainder == 0),
        )

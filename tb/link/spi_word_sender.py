# SPDX-License-Identifier: Apache-2.0
"""What rtl/link/spi_word_sender.sv does, in integers: step(...) is one clk and returns (ready, cs_n, sclk, sdi, busy) after it."""

BITS, TAIL = 16, 3                          # halves of sclk after the bits: one of hold, two with cs_n high


class SpiWordSender:
    def __init__(self, clk_hz, sclk_hz=1_000_000):
        self.half = max(-(-clk_hz // (2 * sclk_hz)), 1)
        self.word, self.age = 0, None       # age: clk since the word was taken

    def step(self, valid, word, rst=0):
        if rst:
            self.age = None
        elif self.age is not None:
            self.age += 1
            if self.age == (2 * BITS + TAIL) * self.half:
                self.age = None
        elif valid:
            self.word, self.age = word, 0
        return self.pins()

    def pins(self):
        if self.age is None:
            return 1, 1, 0, 0, 0
        place = self.age // self.half
        inside = place < 2 * BITS
        return 0, int(place > 2 * BITS), int(inside and place % 2), self.word >> BITS - 1 - place // 2 & 1 if inside else 0, 1

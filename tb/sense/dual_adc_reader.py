# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/dual_adc_reader.sv: step(start, sdata_a, sdata_b, rst) advances one cycle and
returns the outputs after it.
"""


class DualAdcReader:
    def __init__(self, w=8, leading=2, frame=14):
        self.w, self.leading, self.frame = w, leading, frame
        self.cycle = None  # cycles since cs_n fell, None between frames
        self.words, self.sample = [0, 0], (0, 0)

    def step(self, start, sdata_a, sdata_b, rst=0):
        valid = 0
        if self.cycle is None:
            if start and not rst:
                self.cycle, self.words = 0, [0, 0]
        else:
            self.cycle += 1
            number, falls = (self.cycle + 1) // 2, self.cycle % 2 == 1
            if falls and self.leading < number <= self.leading + self.w:
                self.words = [2 * word + bit for word, bit in zip(self.words, (sdata_a, sdata_b))]
                if number == self.leading + self.w:
                    valid = int(not rst)
                    self.sample = tuple(word - (1 << self.w - 1) for word in self.words)
            if rst or self.cycle == 2 * self.frame:
                self.cycle = None
        cs_n = int(self.cycle is None)
        return cs_n, int(cs_n or self.cycle % 2 == 0), valid, *self.sample

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/biquad_cascade.sv in integers: clk(...) advances one cycle and returns the
outputs after it.
"""

FRACTION = 30  # bits of a coefficient
STAGE = 36  # cycles per section from x to y
PAST = 4 * 35 + 1  # cycles per section to add up its past terms afterwards
LOW, HIGH = -1 << 31, (1 << 31) - 1


class BiquadCascade:
    def __init__(self, sections=2):
        self.sections = sections
        self.coefficients = [[0] * 8 for _ in range(4)]
        self.reset()

    def reset(self):
        self.n = None  # cycles since the sample, None: ready
        self.streams = [(0, 0)] * (
            self.sections + 1
        )  # two past samples of each stream, the newer one first
        self.remainders = [0] * self.sections
        self.samples = 0  # consecutive samples that the sections know
        self.filtering = 0
        self.y = 0

    def sample(self, section, x, works):
        if not works:
            self.remainders[section] = 0
            return x
        terms = zip(
            self.coefficients[section], (x, *self.streams[section], *self.streams[section + 1])
        )
        y, self.remainders[section] = divmod(
            sum(c * s for c, s in terms) + self.remainders[section], 1 << FRACTION
        )
        if not LOW <= y <= HIGH:
            self.remainders[section] = 0
        return max(LOW, min(HIGH, y))

    def clk(
        self,
        rst=0,
        in_use=0,
        coefficient_write=0,
        coefficient_address=0,
        coefficient=0,
        valid_in=0,
        track=0,
        x=0,
    ):
        """Advance one cycle. Coefficients must not change while in use, and in_use must not rise
        and fall within a sample.
        """
        if coefficient_write:
            self.coefficients[coefficient_address >> 3][coefficient_address & 7] = coefficient
        if rst:
            self.reset()
            return 1, 0, 0
        valid = 0
        if self.n is None:
            if valid_in:
                self.n, self.track, self.values = 0, track, [x]
        else:
            self.n += 1
            section, remainder = divmod(self.n, STAGE)
            if remainder == 0 and section <= self.sections:
                works = not self.track and self.filtering & in_use & 1 << section - 1
                self.values.append(self.sample(section - 1, self.values[-1], works))
            if self.n == STAGE * self.sections:
                valid, self.y = 1, self.values[-1]
                self.samples = 1 if self.track else self.samples + 1
                self.filtering = in_use if self.samples > 1 else 0
                self.streams = [(new, old) for new, (old, _) in zip(self.values, self.streams)]
            if self.n == (STAGE + PAST) * self.sections:
                self.n = None
        return int(self.n is None), valid, self.y

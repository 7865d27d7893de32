# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/compensate/harmonic_map.sv in integers: clk(...) advances one cycle; the attributes
hold the state after it.

term_of(amplitude, phase) makes the words of a term from counts and radians; exact(terms, turn) is
the sum that these words represent.
"""

import math

STEPS = 22
ROTATIONS = [round(math.atan(2.0**-n) * 2**32 / (2 * math.pi)) for n in range(24)]  # 2^-32 turn
GAIN = math.prod(math.sqrt(1 + 4.0**-n) for n in range(STEPS))
SETTLE = 35  # cycles of a round in addition to its terms


def signed(value, bits):
    value &= (1 << bits) - 1
    return value - (value >> bits - 1 << bits)


def term_of(amplitude, phase):
    """The words of a term: amplitude in counts, phase in radians."""
    return round(amplitude * 2**16 / GAIN), round(phase / (2 * math.pi) * 2**32) % 2**32


def exact(terms, turn):
    """Counts at an angle in turns, from the words of the terms, order 1 first."""
    return sum(
        a / 2**16 * GAIN * math.sin(2 * math.pi * (k * turn + phase / 2**32))
        for k, (a, phase) in enumerate(terms, 1)
    )


def rotated(amplitude, angle, steps):
    """(x, y) in 2^-24 count: the vector of the amplitude, rotated by 2^-32 turn times the angle and
    lengthened by the gain.
    """
    x, y, remainder = amplitude << 8, 0, signed(angle, 32)
    if (angle >> 31 ^ angle >> 30) & 1:
        x, remainder = ~x, signed(angle ^ 1 << 31, 32)
    for n in range(steps):
        if remainder < 0:
            x, y, remainder = x + (y >> n), y + ~(x >> n), remainder + ROTATIONS[n]
        else:
            x, y, remainder = x + ~(y >> n), y + (x >> n), remainder + ~ROTATIONS[n]
        remainder = signed(remainder, 32)
    return x, y


def round_of(k, steps=STEPS):
    """Cycles of a round."""
    return (steps + 2) * (k + k % 2) + SETTLE


def summed(terms, angle, radians_per_count, steps):
    """(sum in 2^-24 count, slope in 2^-28 count per count)."""
    terms = [*terms, *[(0, 0)] * (len(terms) % 2)]
    total = run = weighted = 0
    for k in range(len(terms), 0, -1):
        x, y = rotated(terms[k - 1][0], (k * angle + terms[k - 1][1]) % 2**32, steps)
        total, run = total + y, run + x
        weighted += run >> 14
    return total, signed(weighted * radians_per_count >> 22, 29)


class HarmonicMap:
    def __init__(self, k=16, w=32, steps=STEPS):
        self.k, self.w, self.steps = k, w, steps
        self.sets = [[(0, 0)] * k, [(0, 0)] * k]
        self.position_q = self.corrected = 0
        self.reset()

    def reset(self):
        self.page, self.swapped, self.correction = 0, False, 0
        self.stop()

    def stop(self):
        self.left = None  # cycles of the round that are left
        self.base = self.slope = self.offset = self.since = 0
        self.refreshed = False

    def clk(
        self,
        rst=0,
        enable=0,
        radians_per_count=0,
        write=0,
        term=0,
        amplitude=0,
        phase=0,
        swap=0,
        angle=0,
        step=0,
        position=0,
    ):
        self.corrected = signed((self.position_q << 16) - self.correction, self.w + 16)
        self.position_q = position
        self.correction = signed(self.base + (self.offset >> 4) + 128 >> 8, 32)
        ends = self.left == 1
        if ends:
            self.base, self.offset = self.total, self.since
        begins = enable and self.swapped and (ends or self.left is None)
        self.since = (0 if begins else self.since) + step * self.slope
        self.offset += step * self.slope
        self.refreshed = ends
        if self.left == 2:
            self.total, self.slope = summed(self.terms, self.angle, radians_per_count, self.steps)
        self.left = self.left - 1 if self.left and not ends else None
        if begins:
            self.left, self.angle, self.terms = (
                round_of(self.k, self.steps),
                angle,
                list(self.sets[self.page]),
            )
        if write:
            self.sets[1 - self.page][term] = (amplitude, phase)
        if swap:
            self.page, self.swapped, self.left = 1 - self.page, True, None
        if rst or not enable:
            self.stop()
        if rst:
            self.reset()

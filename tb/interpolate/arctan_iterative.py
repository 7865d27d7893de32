# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/arctan_iterative.sv: sample() computes one sample,
ArctanIterative.step() advances one cycle.
"""

from functools import cache

from tables import arctan_rotation


def latency(w):
    return arctan_rotation.ITERATIVE[w][1] + 1


@cache
def angles(w):
    """The angle of each digit, from digit 1 on."""
    turns, digits, _, guard = arctan_rotation.ITERATIVE[w]
    first = arctan_rotation.entry(turns, 1, 0, 1, guard) - (1 << guard - 1)
    return [None, first] + [
        arctan_rotation.entry(turns, digit, 0, 1, guard) for digit in range(2, digits + 1)
    ]


def sample(w, sin, cos):
    """Returns (phase, amplitude)."""
    if not sin and not cos:
        return 0, 0
    turns, digits, f, guard = arctan_rotation.ITERATIVE[w]
    steep = abs(sin) > abs(cos)
    y, x = sorted((abs(sin), abs(cos)))
    turned = steep ^ (sin < 0) ^ (cos < 0)
    longer, shorter = x << f, (y << f) - 1  # shorter is stored as its value less 1
    angle = ((sin < 0 if steep else cos < 0) << 15 | steep << 14) << guard | 1 << guard - 1
    for digit in range(1, digits + 1):
        negative = shorter < 0 and digit > 1
        magnitude = ~shorter if negative else shorter
        turned ^= negative
        angle += -angles(w)[digit] if turned else angles(w)[digit]
        shorter = 2 * magnitude + (not negative) - longer - negative
        if digit <= turns:
            longer += (magnitude + (digit == 1) >> 2 * digit - 2) + 1 >> 1
    eighths = longer >> f - 3
    size = (eighths | 7) - 3 - (eighths >> 3) - (eighths >> 6) - (eighths >> 11) >> 3
    return (angle >> guard) % (1 << 16), size


class ArctanIterative:
    def __init__(self, w):
        self.w, self.left, self.coming, self.out = w, 0, (0, 0), (0, 0)

    def step(self, valid, sin, cos):
        """Returns (done, phase, amplitude)."""
        done = self.left == 1
        if done:
            self.out = self.coming
        if self.left:
            self.left -= 1
        elif valid:
            self.left, self.coming = latency(self.w) - 1, sample(self.w, sin, cos)
        return int(done), *self.out

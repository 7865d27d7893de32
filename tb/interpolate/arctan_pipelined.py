# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/arctan_pipelined.sv: sample() computes one sample,
ArctanPipelined.step() advances one cycle.
"""

from collections import deque
from functools import cache

from tables import arctan_rotation


def latency(w, steps=1):
    return -(-(arctan_rotation.PIPELINED[w][1] + 1) // steps)


def moved(value, bits):
    """Shift left by this many bits, or right with truncation if negative."""
    return value << bits if bits >= 0 else value >> -bits


@cache
def sums(w):
    """(first, count, entries) of each sum of angles."""
    turns, digits, _, guard = arctan_rotation.PIPELINED[w]
    return [
        (
            first,
            count,
            [arctan_rotation.entry(turns, first, n, count, guard) for n in range(1 << count)],
        )
        for first, count in arctan_rotation.groups(digits)
    ]


def sample(w, sin, cos):
    """Returns (phase, amplitude)."""
    if not sin and not cos:
        return 0, 0
    turns, digits, head, guard = arctan_rotation.PIPELINED[w]
    steep = 2 * abs(sin) - (sin < 0) > 2 * abs(cos) - (cos < 0)
    y, x = sorted((abs(sin), abs(cos)))
    found = [steep ^ (sin < 0) ^ (cos < 0)]
    longer, shorter, x_bits, y_bits = (
        2 * x + y,
        2 * y - x - 1,
        1,
        0,
    )  # fraction bits; shorter is stored as its value less 1
    for digit in range(2, digits):
        negative = shorter < 0
        magnitude, one = (
            ~shorter if negative else shorter,
            int(not negative),
        )  # magnitude + one is the magnitude of the shorter component
        found.append(found[-1] ^ negative)
        new_y_bits = min(head - digit - 1, max(y_bits - 1, x_bits))
        up = new_y_bits - y_bits + 1
        doubled, taken = (magnitude << up) + ((one << up) - one), moved(longer, new_y_bits - x_bits)
        less = negative if digit <= turns + 2 else moved(longer, new_y_bits - x_bits + 1) & 1
        if digit <= turns:
            new_x_bits = min(head - digit - 2, max(x_bits, y_bits + 2 * digit - 1))
            down = y_bits + 2 * digit - 1 - new_x_bits
            longer = (
                moved(longer, new_x_bits - x_bits)
                + (magnitude >> down)
                + (magnitude >> down - 1 & 1 if down else one)
            )
            x_bits = new_x_bits
        shorter, y_bits = doubled - taken - less, new_y_bits
    found.append(found[-1] ^ (shorter < 0))

    angle = ((sin < 0 if steep else cos < 0) << 15 | steep << 14) << guard
    for first, count, entries in sums(w):
        angle += entries[
            sum(negative << j for j, negative in enumerate(found[first - 1 : first - 1 + count]))
        ]
    halves = longer >> x_bits - 1
    size = halves - ((halves >> 3) + (halves >> 6) + (halves >> 11)) >> 1
    return (angle >> guard) % (1 << 16), size


class ArctanPipelined:
    def __init__(self, w, steps=1):
        self.w, self.coming, self.out = w, deque([None] * latency(w, steps)), (0, 0)

    def step(self, valid, sin, cos):
        """Returns (done, phase, amplitude)."""
        self.coming.popleft()
        self.coming.append(sample(self.w, sin, cos) if valid else None)
        self.out = self.coming[0] or self.out
        return int(self.coming[0] is not None), *self.out

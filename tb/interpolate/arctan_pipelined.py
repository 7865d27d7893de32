# SPDX-License-Identifier: Apache-2.0
"""What rtl/interpolate/arctan_pipelined.sv does, in integers: sample() is one sample, ArctanPipelined.step() one clk."""
import sys
from collections import deque
from functools import cache
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "tables"))

import arctan_rotation  # noqa: E402  (found through the line above)


def latency(w, steps=1):
    turns, pairs, _, _ = arctan_rotation.PIPELINED[w]
    return -(-(turns + pairs + 3) // steps)


def moved(value, places):
    """Up by so many bits, or down, cut off."""
    return value << places if places >= 0 else value >> -places


@cache
def sums(w):
    """(first, count, entries) of each sum of angles."""
    turns, pairs, _, guard = arctan_rotation.PIPELINED[w]
    return [(first, count, [arctan_rotation.entry(turns, first, n, count, guard) for n in range(1 << count)])
            for first, count in arctan_rotation.groups(turns + 2 * pairs + 2)]


def sample(w, sin, cos):
    """(phase, amplitude)"""
    turns, pairs, head, guard = arctan_rotation.PIPELINED[w]
    steep = (sin + cos < 0) == (sin - cos < 0)
    y, x = (abs(cos), abs(sin)) if steep else (abs(sin), abs(cos))
    frame = steep ^ (sin < 0) ^ (cos < 0)
    found = [frame]
    longer, shorter, x_bits, y_bits = 2 * x + y, 2 * y - x - 1, 1, 0        # shorter is less by 1 than it is, here and below

    def look():
        """The shorter leg without its sign is rest + one."""
        nonlocal frame
        negative = shorter < 0
        frame ^= negative
        return (~shorter if negative else shorter), int(not negative)

    for digit in range(2, turns + 2):
        rest, one = look()
        found.append(frame)
        new_y_bits = min(head - digit - 1, max(y_bits - 1, x_bits))
        up = new_y_bits - y_bits + 1
        next_shorter = (rest << up) + ((one << up) - one) + one - moved(longer, new_y_bits - x_bits) - 1
        if digit <= turns:
            new_x_bits = min(head - digit - 2, max(x_bits, y_bits + 2 * digit - 1))
            down = y_bits + 2 * digit - 1 - new_x_bits
            longer = moved(longer, new_x_bits - x_bits) + (rest >> down) + (rest >> down - 1 & 1 if down else one)
            x_bits = new_x_bits
        shorter, y_bits = next_shorter, new_y_bits
    for _ in range(pairs):
        rest, one = look()
        beyond = rest + one <= moved(longer, y_bits - 1 - x_bits)
        found += [frame, frame ^ beyond]
        y_bits -= 2
        shorter = rest + one - moved(longer if beyond else 3 * longer, y_bits - x_bits) - 1
    look()
    found.append(frame)

    angle = ((sin < 0 if steep else cos < 0) << 15 | steep << 14 | 0) << guard | 1 << guard - 1
    for first, count, entries in sums(w):
        angle += entries[sum(negative << j for j, negative in enumerate(found[first - 1:first - 1 + count]))]
    eighths = longer >> x_bits - 3
    size = eighths - ((eighths >> 3) + (eighths >> 6) + (eighths >> 11)) + 4 >> 3
    return (angle >> guard) % (1 << 16) if sin or cos else 0, size


class ArctanPipelined:
    def __init__(self, w, steps=1):
        self.w, self.coming, self.out = w, deque([None] * latency(w, steps)), (0, 0)

    def step(self, valid, sin, cos):
        """(done, phase, amplitude)"""
        self.coming.append(sample(self.w, sin, cos) if valid else None)
        self.coming.popleft()
        if new := self.coming[0]:
            self.out = new
        return int(new is not None), *self.out

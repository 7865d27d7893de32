# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/interpolate/arctan_quotient.sv: phase_of() computes one sample,
ArctanQuotient.step() advances one cycle.
"""

from collections import deque

from tables import arctan_quotient

LATENCY = 12


def phase_of(sin, cos):
    if not sin and not cos:
        return 0
    # The difference of the magnitudes has the sign of sin. If both signs are equal it is 1 less.
    gap = sin + cos if (sin < 0) != (cos < 0) else sin - cos - 1
    steep = (gap < 0) == (sin < 0)
    remainder, divisor = (cos, sin) if steep else (sin, cos)
    negative = (remainder < 0) != (divisor < 0)
    number = 0
    for _ in range(arctan_quotient.DIGITS):
        same = (remainder < 0) == (divisor < 0)
        number = 2 * number + (same != negative)
        remainder = 2 * remainder - (divisor if same else -divisor)
    octant = arctan_quotient.octant(number % (1 << arctan_quotient.DIGITS - 1))
    octant >>= arctan_quotient.GUARD
    quarter = 2 * (divisor < 0) + steep
    return (quarter * 16384 + (-octant if steep != negative else octant)) % 65536


class ArctanQuotient:
    def __init__(self, sample_cycles=1):
        self.serial = sample_cycles >= LATENCY
        self.coming, self.phase = deque([None] * LATENCY), 0

    def step(self, valid, sin, cos):
        """Returns (done, phase)."""
        self.coming.popleft()
        if valid and self.serial:  # it replaces the one in progress
            self.coming = deque([self.coming[0]] + [None] * (LATENCY - 2))
        self.coming.append(phase_of(sin, cos) if valid else None)
        done = self.coming[0] is not None
        self.phase = self.coming[0] if done else self.phase
        return int(done), self.phase

# SPDX-License-Identifier: Apache-2.0
"""Functions shared by the tests of the arctan modules: the true phase, and the pairs on which the
rounding is decided.
"""

import math
from itertools import product

import numpy as np

LSB = 65536 / math.tau  # LSB per radian


def error(phase, sin, cos):
    """Error in LSB against the true phase. A double is wrong by 1e-11 LSB here; no tie of 8, 9 or
    10 bits is nearer than 2e-5.
    """
    away = phase - math.atan2(sin, cos) * LSB
    return away - round(away / 65536) * 65536


def close_calls(w, allowed):
    """All pairs whose true phase is nearer to a tie than the arctan may be wrong there:
    allowed(radius) is its bound less one half.
    """
    channel = np.arange(-1 << w - 1, 1 << w - 1)
    sin, cos = (a.ravel() for a in np.meshgrid(channel, channel))
    true, radius = np.arctan2(sin, cos) * LSB, np.hypot(sin, cos)
    chosen = (np.abs(true - np.floor(true) - 0.5) <= allowed(np.maximum(radius, 1))) & (radius > 0)
    return list(zip(sin[chosen].tolist(), cos[chosen].tolist()))


def turned(smaller, larger, octant, largest):
    """The pair in another octant: the channels are exchanged and negated by the bits of `octant`;
    `largest` exists only with a minus sign.
    """
    first, second = (
        -channel if channel == largest or octant >> bit & 1 else channel
        for bit, channel in enumerate((smaller, larger))
    )
    return (second, first) if octant & 4 else (first, second)


def pairs_of_8_bits(whole):
    """All pairs, or every pair of one octant, each turned into one of the octants in rotation."""
    if whole:
        return list(product(range(-128, 128), repeat=2))
    octant = [(smaller, larger) for larger in range(129) for smaller in range(larger + 1)]
    return [turned(*pair, number % 8, 128) for number, pair in enumerate(octant)]

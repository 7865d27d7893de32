# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/vector_length.sv for one sample or for arrays of samples."""

import numpy as np


def vector_length(sin, cos):
    """Returns (length, axis, quadrant, tilt)."""
    sin, cos = np.asarray(sin, dtype=np.int64), np.asarray(cos, dtype=np.int64)
    sin_size, cos_size = abs(sin), abs(cos)
    sin_low, cos_low, steep = sin < 0, cos < 0, sin_size > cos_size
    major, minor = np.maximum(sin_size, cos_size), np.minimum(sin_size, cos_size)
    # exact: a double holds 53 bits, and the root of one is rounded correctly
    twice = np.sqrt(4 * (sin * sin + cos * cos)).astype(np.int64)
    length = twice + 1 >> 1
    axis = np.where(steep, 1 + 2 * sin_low, 2 * cos_low)
    quadrant = 2 * sin_low + (sin_low ^ cos_low)
    tilt = sum((8 * minor > n * major).astype(np.int64) for n in (1, 3, 5, 7))
    return length, axis, quadrant, tilt

# SPDX-License-Identifier: Apache-2.0
"""The integer functions of the firmware, against Python's integers."""

import ctypes
import random
from functools import cache
from math import isqrt

import pytest

from tb.bench import seed
from twin.compiled import firmware

MOST = 1 << 64
INT64, UINT64 = ctypes.c_int64, ctypes.c_uint64
TYPES = {
    "bits": (ctypes.c_int, UINT64),
    "pairs": (UINT64, ctypes.c_uint32),
    "triples": (UINT64, ctypes.c_uint32),
    "product": (INT64, INT64, ctypes.c_uint32, ctypes.c_int),
    "ratio": (INT64, INT64, ctypes.c_int, UINT64),
    "share": (INT64, INT64, UINT64, UINT64),
    "root": (ctypes.c_uint32, UINT64),
}


@cache
def function(name):
    """A function of core/arithmetic.c."""
    found = getattr(firmware.library(), name)
    found.restype, *found.argtypes = TYPES[name]
    return found


def numbers(count, width, signed=False):
    """Random numbers of all lengths up to a width, and those beside the powers of two."""
    draw = random.Random(f"arithmetic {seed()} {width}")
    edges = {(1 << n) + d for n in range(width) for d in (-1, 0, 1)}
    found = {n for n in edges if 0 <= n < 1 << width}
    found |= {draw.getrandbits(draw.randrange(1, width + 1)) for _ in range(count)}
    return sorted(found | {-n for n in found if signed})


def test_bits_is_the_length_of_a_number():
    for x in numbers(200, 64):
        assert function("bits")(x) == x.bit_length(), x


@pytest.mark.parametrize("name, things", [("pairs", 2), ("triples", 3)])
def test_pairs_and_triples_are_binomials(name, things):
    for n in numbers(200, 32):
        expected = n * (n - 1) // 2 if things == 2 else n * (n - 1) * (n - 2) // 6
        assert function(name)(n) == max(expected, 0) % MOST, n


def test_a_product_is_exact_and_rounded_down():
    draw = random.Random(f"product {seed()}")
    for x in numbers(300, 63, signed=True):
        m = draw.getrandbits(draw.randrange(1, 33))
        room = 62 - (x * m).bit_length()  # for a shift to the left
        shift = draw.randrange(max(-room, -20), 100)
        expected = x * m << -shift if shift < 0 else x * m >> shift
        assert function("product")(x, m, shift) == expected, (x, m, shift)


def test_a_product_may_be_shifted_to_either_side():
    for x, m, shift, expected in ((-3, 5, -4, -240), (7 << 40, 3, -1, 42 << 40), (-1, 1, 99, -1)):
        assert function("product")(x, m, shift) == expected


def test_a_ratio_is_rounded_towards_zero_and_saturates():
    draw = random.Random(f"ratio {seed()}")
    for x in numbers(300, 62, signed=True):
        divisor = draw.getrandbits(draw.randrange(1, 62)) + 1
        room = 60 + divisor.bit_length() - x.bit_length()  # for a quotient below 2^61
        shift = draw.randrange(-70, max(room, -69))
        shifted = abs(x) << shift if shift > 0 else abs(x) >> -shift
        expected = shifted // divisor * (-1 if x < 0 else 1)
        assert function("ratio")(x, shift, divisor) == expected, (x, shift, divisor)
    assert function("ratio")(1 << 61, 40, 1) == (1 << 63) - 1 >> 1
    assert function("ratio")(-(1 << 61), 40, 1) == -(1 << 62)


def test_a_share_has_a_relative_error_of_at_most_2_to_the_minus_15():
    draw = random.Random(f"share {seed()}")
    for whole in numbers(300, 62)[1:]:
        part = draw.randrange(whole) + 1
        x = draw.getrandbits(40) << 20
        exact = x * part / whole
        assert abs(function("share")(x, part, whole) - exact) <= exact / (1 << 15) + 1, whole


def test_a_root_is_rounded_down():
    draw = random.Random(f"root {seed()}")
    roots = [draw.getrandbits(draw.randrange(1, 33)) for _ in range(300)]
    near = [r * r + d for r in roots for d in (-1, 0, 1) if r * r + d >= 0]
    for x in [*numbers(300, 64), *near, MOST - 1]:
        assert function("root")(x) == isqrt(x), x

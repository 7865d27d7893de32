# SPDX-License-Identifier: Apache-2.0
"""Make sw/firmware/made/waves.h: the sine of 512 points a circle, and the sums over a burst that
do not depend on the burst. The calibration of the firmware reads both from its program memory.
"""

import sys
import textwrap
from fractions import Fraction
from functools import cache

from tables import made_files
from tables.harmonic_rotation import arctan

PI = round(4 * (4 * arctan(5) - arctan(239)) * (1 << 64))  # 2^-64, by Machin's formula
POINTS = 512  # of a circle
LARGEST = 32767  # 1.0
BLOCKS = 256  # of a burst of phases
MADE = made_files.ROOT / "sw" / "firmware" / "made" / "waves.h"


@cache
def sine(point: int) -> int:
    """The sine of a point of the circle, rounded to the nearest integer."""
    quarter, into = divmod(point % POINTS, POINTS // 4)
    if quarter % 2:
        into = POINTS // 4 - into
    x = Fraction(2 * PI * into, POINTS << 64)
    total, term, n = Fraction(0), x, 1
    while abs(term) > Fraction(1, 1 << 40):
        total += term
        term *= -x * x / ((n + 1) * (n + 2))
        n += 2
    return round(total * LARGEST) * (1 if quarter < 2 else -1)


def motion_sums() -> list[list[int]]:
    """Sums over the blocks of window times products of 1, time and its square. Time runs from
    -32768 to 32768 over the burst, and each is a block's at its middle.
    """
    sums = [[0] * 3 for _ in range(3)]
    for n in range(BLOCKS):
        window = LARGEST - sine((2 * n + 1) * (POINTS // 2 // BLOCKS) + POINTS // 4) >> 1
        time = n * (65536 // BLOCKS) + 32768 // BLOCKS - 32768
        base = 32768, time, time * time >> 15
        for i, first in enumerate(base):
            for j, second in enumerate(base):
                sums[i][j] += (window * first >> 15) * second >> 10
    return sums


def wrapped(values: list[int]) -> str:
    text = ", ".join(map(str, values))
    return " \\\n".join(
        textwrap.wrap(text, made_files.COLUMNS - 6, initial_indent="    ", subsequent_indent="    ")
    )


def text() -> str:
    circle = [sine(point) for point in range(POINTS + POINTS // 4)]
    rows = ", ".join("{" + ", ".join(map(str, row)) + "}" for row in motion_sums())
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// Made by tables/waves.py, not to be edited.
#ifndef MOIRE_MADE_WAVES_H
#define MOIRE_MADE_WAVES_H

#define WAVES_POINTS {POINTS}  // of a circle
#define WAVES_BLOCKS {BLOCKS}u  // of a burst

// The sine of a circle and a quarter, 1.0 = {LARGEST}.
#define WAVES_SINE \\
{wrapped(circle)}

// Sums over the blocks of window times products of 1, time and its square.
#define WAVES_MOTION_SUMS \\
    {rows}

#endif
"""


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__ or "", lambda: {MADE: text()}, arguments)


if __name__ == "__main__":
    sys.exit(main())

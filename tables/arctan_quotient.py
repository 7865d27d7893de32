# SPDX-License-Identifier: Apache-2.0
"""Make rtl/interpolate/arctan_quotient_rom.sv, the arctangent of one octant as 32 parabolas.

arctan_quotient divides the smaller component of a sample by the larger one. A digit of the quotient
is 1 or -1, so DIGITS digits leave an error of 2^-DIGITS at most, in either direction. The first
digit is the sign. The next INDEX digits choose a parabola, and the others are the distance t from
its middle: phase = base + slope t - bend t^2.
"""

import math
import sys
from pathlib import Path

from tables import made_files
from tables.made_files import ROOT

PHASE = 16  # bits of a phase; 2^PHASE = one period
DIGITS = 19  # of the quotient; digit i stands for 2^-i
INDEX = 5  # digits that choose the parabola, after the first one
EARLY = 8  # digits of t that are known when bend is multiplied
GUARD = 6  # bits of base below the LSB of the phase
SLOPE_BITS = 2  # fraction bits of slope, in LSB for a quotient of 1
BEND_BITS = 4  # integer bits of bend that are left out, in LSB for a quotient of 1
UNIT = (1 << PHASE) / math.tau  # LSB per radian
REACH = 2.0 ** -(INDEX + 1)  # t at the ends of a parabola

MADE = ROOT / "rtl" / "interpolate" / "arctan_quotient_rom.sv"


def parabola(index: int) -> tuple[int, int, int]:
    """(base, slope, bend) of one parabola: the series of the arctangent about its middle, whose
    cubic term is replaced by the line that comes nearest to it. base includes half an LSB for
    rounding the phase and half a unit for the truncation of the product.
    """
    middle = (2 * index + 1) * REACH
    square = 1 + middle * middle
    cubic = (3 * middle * middle - 1) / (3 * square**3)
    return (
        round(UNIT * math.atan(middle) * (1 << GUARD) + (1 << GUARD - 1) + 0.5),
        round(UNIT * (1 / square + 0.75 * REACH * REACH * cubic) * (1 << SLOPE_BITS)),
        round(UNIT * middle / square**2 / (1 << BEND_BITS)),
    )


PARABOLAS = [parabola(index) for index in range(1 << INDEX)]


def octant(number: int) -> int:
    """The phase of a quotient in LSB / 2^GUARD, with half an LSB for rounding. `number` has the
    digits after the first one; a bit is 1 for the digit 1.
    """
    rest = DIGITS - 1 - INDEX  # digits of t
    index, along = number >> rest, number % (1 << rest)
    base, slope, bend = PARABOLAS[index]
    late = rest - EARLY
    early = 2 * (along >> late) + 1 - (1 << EARLY)
    slope -= bend * early >> INDEX + 1 + EARLY - SLOPE_BITS - BEND_BITS
    return base + (slope * (2 * along + 1 - (1 << rest)) >> DIGITS + SLOPE_BITS - GUARD)


def bound() -> float:
    """Largest error of the phase in LSB, for any sample: every quotient, with the largest error of
    its digits, and one half for the rounding.
    """
    worst = 0.0
    for number in range(1 << DIGITS - 1):
        quotient = (2 * number + 1) / (1 << DIGITS)
        found = octant(number) / (1 << GUARD) - 0.5
        digits = UNIT / (1 + quotient * quotient) / (1 << DIGITS)
        worst = max(worst, abs(found - UNIT * math.atan(quotient)) + digits)
    return 0.5 + worst


def text() -> str:
    bits = [max(column).bit_length() for column in zip(*PARABOLAS)]
    rows = "\n".join(
        f"            {INDEX}'d{index}:".ljust(19)
        + "parabola = {"
        + ", ".join(f"{width}'d{value}" for width, value in zip(bits, values))
        + "};"
        for index, values in enumerate(PARABOLAS[:-1])
    )
    last = ", ".join(f"{width}'d{value}" for width, value in zip(bits, PARABOLAS[-1]))
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// arctan_quotient_rom -- the arctangent of 0 to 1 as {1 << INDEX} parabolas; made by
// tables/arctan_quotient.py, not to be edited.
//
// latency  0 cycles from index to its outputs: a table without a register
// rate     one parabola per cycle
// source   the Taylor series about the middle of each part, with its cubic term replaced by a line
// model    PARABOLAS of tables/arctan_quotient.py
`default_nettype none

module arctan_quotient_rom (
    input  wire  [ {INDEX - 1}:0] index,  // 1/{1 << INDEX} of the quotient
    output logic [{bits[0] - 1}:0] base,   // 1/{1 << GUARD} LSB of phase, rounding included
    output logic [{bits[1] - 1}:0] slope,  // 1/{1 << SLOPE_BITS} LSB of phase for a quotient of 1
    output logic [ {bits[2] - 1}:0] bend    // {1 << BEND_BITS} LSB of phase for a quotient of 1
);
    logic [{sum(bits) - 1}:0] parabola;

    assign {{base, slope, bend}} = parabola;

    always_comb
        case (index)
{rows}
            default: parabola = {{{last}}};
        endcase
endmodule

`default_nettype wire
"""


def made() -> dict[Path, str]:
    return {MADE: text()}


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments, lambda: f"{bound():.4f}")


if __name__ == "__main__":
    sys.exit(main())

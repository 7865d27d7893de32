# SPDX-License-Identifier: Apache-2.0
"""Make rtl/interpolate/arctan_rom.sv: the arc tangent of one octant as 128 chords, in 1/32 LSB of a
16-bit phase.

For a ratio r = (i + f / 2^FRACTION) / 2^INDEX from 0 to 1, phase = floor((base[i] + slope[i] * f /
2^FRACTION) / 2^GUARD).
"""

import math
import sys
from pathlib import Path

from tables import made_files

PHASE = 16  # bits of a phase; 2^PHASE = one period
INDEX = 7  # bits of the ratio that choose the chord
FRACTION = 9  # bits of the ratio along the chord
GUARD = 5  # bits of base and slope below the LSB of the phase
RATIO = INDEX + FRACTION  # bits of the ratio behind the point; it is cut off, not rounded
SEGMENTS = 1 << INDEX
UNIT = (1 << PHASE) / math.tau  # LSB a radian

CUT = UNIT / (1 << RATIO)  # the cut ratio is low by less than this, in LSB of phase
SAG = (
    UNIT * 3 * math.sqrt(3) / 8 / (8 * SEGMENTS**2)
)  # a chord is below its arc by at most h^2/8 max|atan''|
CENTRE = round(
    (CUT + SAG) / 2 * (1 << GUARD)
)  # half of both is added: the error is as far up as down
ROUND = (1 << GUARD - 1) + CENTRE  # stands in every base, with the half of rounding

BASE = [round(UNIT * (1 << GUARD) * math.atan(i / SEGMENTS)) + ROUND for i in range(SEGMENTS + 1)]
SLOPE = [after - before for before, after in zip(BASE, BASE[1:])] + [0]

UP = CENTRE / (1 << GUARD)  # the sum of all but the two roundings lies in -DOWN ... UP
DOWN = CUT + SAG - UP
BOUND = (
    0.5 + max(UP, DOWN) + 0.5 / (1 << GUARD)
)  # LSB; 0.5: phase rounded, the last term: base rounded

BASE_BITS, SLOPE_BITS = max(BASE).bit_length(), max(SLOPE).bit_length()
MADE = Path(__file__).resolve().parent.parent / "rtl" / "interpolate" / "arctan_rom.sv"


def text():
    word = BASE_BITS + SLOPE_BITS
    lines = [
        f"            {INDEX + 1}'d{i:<3} : chord <= {{{BASE_BITS}'d{base}, {SLOPE_BITS}'d{slope}}};"
        for i, (base, slope) in enumerate(zip(BASE, SLOPE))
        if i < SEGMENTS
    ]
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// arctan_rom -- the arc tangent of 0 to 1 as {SEGMENTS} chords; made by tables/arctan.py, not to be edited.
//
// latency  1 clk from index to base, slope     rate  one word per clk
// source   base = 2^{PHASE + GUARD} atan(index / {SEGMENTS}) / 2 pi, rounded, and {ROUND} for rounding the phase; slope = next base - base
// model    BASE and SLOPE of tables/arctan.py
`default_nettype none

module arctan_rom (
    input  wire                  clk,
    input  wire        [{INDEX}:0]     index,     // 1/{SEGMENTS} of the ratio; {SEGMENTS} is the ratio 1
    output logic       [{BASE_BITS - 1}:0]    base,      // 1/{1 << GUARD} LSB of phase, {ROUND} added for rounding
    output logic       [{SLOPE_BITS - 1}:0]    slope      // 1/{1 << GUARD} LSB of phase, over the whole chord
);
    logic [{word - 1}:0] chord;

    assign {{base, slope}} = chord;

    always_ff @(posedge clk)
        case (index)
{chr(10).join(lines)}
            default: chord <= {{{BASE_BITS}'d{BASE[-1]}, {SLOPE_BITS}'d0}};
        endcase
endmodule

`default_nettype wire
"""


def main(arguments=None) -> int:
    return made_files.main(__doc__, lambda: {MADE: text()}, arguments, lambda: f"{BOUND:.4f}")


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make rtl/interpolate/arctan_rom.sv, the arctangent of one octant as 128 chords in 1/32 LSB of a
16-bit phase, and the constants between the marks in arctan_table.sv.

For a ratio r = (i + f / 2^FRACTION) / 2^INDEX from 0 to 1, phase = floor((base[i] + slope[i] * f /
2^FRACTION) / 2^GUARD).
"""

import math
import sys
from pathlib import Path

from tables import made_files
from tables.made_files import ROOT

PHASE = 16  # bits of a phase; 2^PHASE = one period
INDEX = 7  # bits of the ratio that choose the chord
FRACTION = 9  # bits of the ratio along the chord
GUARD = 5  # bits of base and slope below the LSB of the phase
RATIO = INDEX + FRACTION  # fraction bits of the ratio, which is truncated, not rounded
SEGMENTS = 1 << INDEX
UNIT = (1 << PHASE) / math.tau  # LSB per radian

CUT = UNIT / (1 << RATIO)  # the truncated ratio is low by less than this, in LSB of phase
# A chord is below its arc by at most h^2 / 8 max|atan''|.
SAG = UNIT * 3 * math.sqrt(3) / 8 / (8 * SEGMENTS**2)
# Half of both is added, so that the error has the same limit in both directions.
CENTRE = round((CUT + SAG) / 2 * (1 << GUARD))
ROUND = (1 << GUARD - 1) + CENTRE  # included in every base, with the half for rounding

BASE = [round(UNIT * (1 << GUARD) * math.atan(i / SEGMENTS)) + ROUND for i in range(SEGMENTS + 1)]
SLOPE = [after - before for before, after in zip(BASE, BASE[1:])] + [0]

UP = CENTRE / (1 << GUARD)  # the error without the two roundings lies in -DOWN ... UP
DOWN = CUT + SAG - UP
# in LSB; 0.5: the phase is rounded; the last term: the base is rounded
BOUND = 0.5 + max(UP, DOWN) + 0.5 / (1 << GUARD)

BASE_BITS, SLOPE_BITS = max(BASE).bit_length(), max(SLOPE).bit_length()
FOLDER = ROOT / "rtl" / "interpolate"
MADE = FOLDER / "arctan_rom.sv"
BEGIN = "    // made by tables/arctan.py, not to be edited"
END = "    // end of the made constants"


def constants() -> list[str]:
    return [
        f"    localparam int RATIO = {RATIO};  // fraction bits of the ratio",
        f"    localparam int FRACTION = {FRACTION};  // bits of the ratio along the chord",
        f"    localparam int GUARD = {GUARD};  // bits of base and slope below the phase LSB",
    ]


def text() -> str:
    word = BASE_BITS + SLOPE_BITS
    lines = []
    for i, (base, slope) in enumerate(zip(BASE[:SEGMENTS], SLOPE)):
        label = f"{INDEX + 1}'d{i}:"
        chord = f"{{{BASE_BITS}'d{base}, {SLOPE_BITS}'d{slope}}}"
        lines.append(f"            {label:<8} chord <= {chord};")
    unit, top = f"1/{1 << GUARD} LSB of phase", BASE_BITS - 1
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// arctan_rom -- the arctangent of 0 to 1 as {SEGMENTS} chords; made by tables/arctan.py, not to be
// edited.
//
// latency  1 cycle from index to base, slope
// rate     one word per cycle
// source   base = 2^{PHASE + GUARD} atan(index / {SEGMENTS}) / 2 pi, rounded, plus {ROUND};
//          slope = next base - base; the {ROUND} rounds the phase
// model    BASE and SLOPE of tables/arctan.py
`default_nettype none

module arctan_rom (
    input  wire         clk,
    input  wire  [ {INDEX}:0] index,  // 1/{SEGMENTS} of the ratio; {SEGMENTS} is the ratio 1
    output logic [{top}:0] base,   // {unit}, {ROUND} added for rounding
    output logic [{SLOPE_BITS - 1}:0] slope   // {unit}, over the whole chord
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


def made() -> dict[Path, str]:
    table = FOLDER / "arctan_table.sv"
    return {MADE: text(), table: made_files.filled(table, BEGIN, END, constants())}


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments, lambda: f"{BOUND:.4f}")


if __name__ == "__main__":
    sys.exit(main())

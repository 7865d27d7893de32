# SPDX-License-Identifier: Apache-2.0
"""Make rtl/interpolate/arctan_rotation_rom.sv: the angles by which arctan_pipelined and
arctan_iterative turn, 2^-48 turn each.

Of the two legs of a vector the longer is turned to become the amplitude, the shorter until it is
gone. Digit i turns by
atan(2^-i) up to i = TURNS. Then q = shorter / longer is below h = 2^-TURNS, the longer leg stays,
and digit i means 2^-i of q:
atan(q) = q - q^3/3 is met by (1 - h^2/4) q within h^3/12.
"""

import math
import sys
from fractions import Fraction
from pathlib import Path

from tables import made_files

PHASE = 16  # bits of a phase; 2^PHASE = one turn
UNIT = 48  # the made angles are in 2^-UNIT turn
LONGEST = 10  # digits that have an angle of their own

# width of a sample: TURNS, DIGITS, HEAD (fraction bits of the shorter leg + digits found + 1),
# GUARD bits below the LSB
PIPELINED = {8: (8, 23, 19, 12), 9: (9, 27, 22, 15), 10: (10, 28, 24, 16)} | {
    w: (6, 22, 26 - w, 9) for w in range(11, 17)
}
# width of a sample: TURNS, DIGITS, F fraction bits of both legs, GUARD
ITERATIVE = {8: (7, 23, 12, 14), 9: (9, 27, 14, 16), 10: (9, 29, 16, 17)} | {
    w: (7, 22, 10, 11) for w in range(11, 17)
}


def angles_by_hand():
    """pi by Machin and arctan by its series, in whole 2^-UNIT turns: no float stands behind the
    made numbers.
    """
    one = 1 << UNIT + 32

    def arctan(inverse):
        total, term, k = 0, Fraction(1, inverse), 0
        while term * one > Fraction(1, 16):
            total += (-1) ** k * term / (2 * k + 1)
            term /= inverse * inverse
            k += 1
        return total

    turn = 8 * (4 * arctan(5) - arctan(239))
    return [round(arctan(1 << i) / turn * (1 << UNIT)) for i in range(1, LONGEST + 1)], round(
        (1 << UNIT) / turn
    )


ANGLE, RADIAN = angles_by_hand()
MADE = Path(__file__).resolve().parent.parent / "rtl" / "interpolate" / "arctan_rotation_rom.sv"


def angle(digit, turns):
    """Of digit 1, 2, …, in 2^-UNIT turn."""
    return ANGLE[digit - 1] if digit <= turns else (RADIAN - (RADIAN >> 2 * turns + 2)) >> digit


def entry(turns, first, negative, count, guard):
    """Sum of `count` digits from `first` on, each negative where its bit is set, in 2^-guard LSB;
    rounded, but the first digits' sum
    is cut off and has half an LSB added for rounding the phase."""
    total = sum(
        -angle(first + j, turns) if negative >> j & 1 else angle(first + j, turns)
        for j in range(count)
    )
    cut = UNIT - PHASE - guard
    return total + (1 << UNIT - PHASE - 1 if first == 1 else 1 << cut - 1) >> cut


def groups(digits):
    """(first, count) of the sums: the last two have five digits, those before them four, the first
    what is left.
    """
    head = (digits - 11) % 4 + 1
    return [
        (1, head),
        *((first, 4) for first in range(head + 1, digits - 9, 4)),
        (digits - 9, 5),
        (digits - 4, 5),
    ]


def bound(plan, w, radius, iterative=False):
    """LSB from the true phase of a sample of this radius, in counts; what each cause may do at
    most, added up.
    """
    turns, digits, head, guard = plan
    unit = (1 << PHASE) / math.tau  # LSB a radian
    rest = unit * 2.0**-digits  # what is left across
    cubic = unit * 2.0 ** (-3 * turns) / 11  # h^3 / 12, and what stands behind it
    table = (1 + (digits if iterative else len(groups(digits))) / 2) / (
        1 << guard
    )  # the made angles are rounded
    if iterative:  # half a unit in the longer leg at each turn, seen by later digits
        cut = sum(2.0**-digit for digit in range(2, turns + 1)) / 2 * 2.0**-head
    else:  # one unit in the longer leg at each turn, half in the shorter after
        cut = 2.0 ** (1 - head) * (2 * (turns - 2) + (digits - turns - 1) / 2 + 1)
    return 0.5 + rest + cubic + table + unit * cut / (1.16 * radius)


def amplitude_bound(radius):
    """Counts from the true amplitude: what is cut off, and the rest of the gain."""
    return 1.5 + 0.00015 * radius


def quarter_bound(plans, w):
    """The bound from a quarter of full scale on."""
    return bound(plans[w], w, (1 << w - 1) / 4, plans is ITERATIVE)


def text():
    cases = "\n".join(
        f"            {i:<7}: angle = 64'd{ANGLE[i - 1]};" for i in range(1, LONGEST + 1)
    )
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// arctan_rotation_rom -- the sum of a few of the angles that a vector was turned by; made by tables/arctan_rotation.py, not to be edited.
//
// latency  0 clk, a table               rate  any
// source   digit i turns by atan(2^-i) up to TURNS, by (1 - 2^-2(TURNS + 1)) 2^-i after it, all in 2^-{UNIT} turn
// model    entry() of tables/arctan_rotation.py
`default_nettype none

module arctan_rotation_rom #(
    parameter int TURNS = 6,                // digits with an angle of their own, up to {LONGEST}
    parameter int FIRST = 1,                // the first digit; sums from 1 on are cut off and have half an LSB added, others are rounded
    parameter int COUNT = 4,                // digits in the sum
    parameter int GUARD = 9,                // bits below the LSB of a {PHASE}-bit phase
    localparam int B = {PHASE} + GUARD - FIRST
) (
    input  wire         [COUNT-1:0] negative,   // digit FIRST is bit 0
    output logic signed [B-1:0]     sum         // 2^-GUARD LSB of phase
);
    if (TURNS < 1 || TURNS > {LONGEST}) begin : g_check_turns TURNS_MUST_BE_FROM_1_TO_{LONGEST} u_error (); end
    if (COUNT < 1 || COUNT > 5) begin : g_check_count COUNT_MUST_BE_FROM_1_TO_5 u_error (); end

    localparam int CUT = {UNIT - PHASE} - GUARD;

    function [63:0] angle(input int digit);
        if (digit > TURNS) angle = (64'd{RADIAN} - (64'd{RADIAN} >> (2 * TURNS + 2))) >> digit;
        else case (digit)
{cases}
            default: angle = 64'd0;
        endcase
    endfunction

    localparam [63:0] HALF = 64'd1 << (FIRST == 1 ? {UNIT - PHASE - 1} : CUT - 1);
    localparam [63:0] A0 = angle(FIRST), A1 = angle(FIRST + 1), A2 = angle(FIRST + 2), A3 = angle(FIRST + 3),
                      A4 = angle(FIRST + 4);

    wire [B-1:0] row [0:(1<<COUNT)-1];
    for (genvar n = 0; n < 1 << COUNT; n++) begin : g_row
        assign row[n] = B'((HALF + (n % 2 > 0 ? -A0 : A0) + (COUNT < 2 ? 64'd0 : n / 2 % 2 > 0 ? -A1 : A1)
                            + (COUNT < 3 ? 64'd0 : n / 4 % 2 > 0 ? -A2 : A2)
                            + (COUNT < 4 ? 64'd0 : n / 8 % 2 > 0 ? -A3 : A3)
                            + (COUNT < 5 ? 64'd0 : n / 16 > 0 ? -A4 : A4)) >> CUT);
    end

    assign sum = $signed(row[negative]);
endmodule

`default_nettype wire
"""


def bounds():
    return "\n".join(
        f"{w} bits: pipelined {quarter_bound(PIPELINED, w):.3f}, iterative {quarter_bound(ITERATIVE, w):.3f} LSB"
        for w in PIPELINED
    )


def main(arguments=None) -> int:
    return made_files.main(__doc__, lambda: {MADE: text()}, arguments, bounds)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make the constants of arctan_pipelined and arctan_iterative.

rtl/interpolate/arctan_rotation_rom.sv holds the angles by which both modules rotate a vector; the
widths and counts are between two marks in each module.

The longer component of a vector is rotated until it is the amplitude, the shorter one until it is
zero. Digit i rotates by atan(2^-i) up to i = TURNS. From then on q = shorter / longer is below
h = 2^-TURNS, the longer component stays as it is, and digit i stands for 2^-i of q:
(1 - h^2 / 4) q approximates atan(q) = q - q^3 / 3 within h^3 / 12.
"""

import math
import sys
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path

from tables import made_files
from tables.made_files import ROOT

PHASE = 16  # bits of a phase; 2^PHASE = one turn
UNIT = 48  # the made angles are in 2^-UNIT turn
LONGEST = 10  # digits that have an angle of their own

Plan = tuple[int, int, int, int]
# width of a sample: TURNS, DIGITS, HEAD (fraction bits of the shorter component + digits found
# + 1), GUARD bits below the LSB
PIPELINED: dict[int, Plan] = {8: (8, 23, 19, 12), 9: (9, 27, 22, 15), 10: (10, 28, 24, 16)} | {
    w: (6, 22, 26 - w, 9) for w in range(11, 17)
}
# width of a sample: TURNS, DIGITS, F fraction bits of both components, GUARD
ITERATIVE: dict[int, Plan] = {8: (7, 23, 12, 14), 9: (9, 27, 14, 16), 10: (9, 29, 16, 17)} | {
    w: (7, 22, 10, 11) for w in range(11, 17)
}


def angles_by_hand() -> tuple[list[int], int]:
    """The angles in whole 2^-UNIT turns, with pi by Machin's formula and arctan by its series: the
    made numbers do not depend on floating-point arithmetic.
    """
    one = 1 << UNIT + 32

    def arctan(inverse: int) -> Fraction:
        total, term, k = Fraction(0), Fraction(1, inverse), 0
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
FOLDER = ROOT / "rtl" / "interpolate"
MADE = FOLDER / "arctan_rotation_rom.sv"
BEGIN = "    // made by tables/arctan_rotation.py, not to be edited"
END = "    // end of the made constants"


def angle(digit: int, turns: int) -> int:
    """The angle of digit 1, 2, …, in 2^-UNIT turn."""
    return ANGLE[digit - 1] if digit <= turns else (RADIAN - (RADIAN >> 2 * turns + 2)) >> digit


def entry(turns: int, first: int, negative: int, count: int, guard: int) -> int:
    """Sum of `count` digits from `first` on, in 2^-guard LSB; a set bit of `negative` makes its
    digit negative. The sum is rounded, but the sum of the first digits is truncated and includes
    half an LSB for rounding the phase.
    """
    total = sum(
        -angle(first + j, turns) if negative >> j & 1 else angle(first + j, turns)
        for j in range(count)
    )
    cut = UNIT - PHASE - guard
    return total + (1 << UNIT - PHASE - 1 if first == 1 else 1 << cut - 1) >> cut


def groups(digits: int) -> list[tuple[int, int]]:
    """(first, count) of each sum: the last two have five digits, those before them four, and the
    first one has the digits that remain.
    """
    head = (digits - 11) % 4 + 1
    return [
        (1, head),
        *((first, 4) for first in range(head + 1, digits - 9, 4)),
        (digits - 9, 5),
        (digits - 4, 5),
    ]


def bound(plan: Plan, w: int, radius: float, iterative: bool = False) -> float:
    """Largest error of the phase, in LSB, for a sample of this radius in counts: the sum of the
    largest error of each cause.
    """
    turns, digits, head, guard = plan
    unit = (1 << PHASE) / math.tau  # LSB a radian
    remainder = unit * 2.0**-digits  # of the shorter component
    cubic = unit * 2.0 ** (-3 * turns) / 11  # h^3 / 12 and the smaller terms
    table = (1 + (digits if iterative else len(groups(digits))) / 2) / (
        1 << guard
    )  # the made angles are rounded
    if iterative:  # half a unit in the longer component at each rotation, seen by later digits
        cut = sum(2.0**-digit for digit in range(2, turns + 1)) / 2 * 2.0**-head
    else:  # one unit in the longer component at each rotation, half in the shorter after
        cut = 2.0 ** (1 - head) * (2 * (turns - 2) + (digits - turns - 1) / 2 + 1)
    return 0.5 + remainder + cubic + table + unit * cut / (1.16 * radius)


def amplitude_bound(radius: float) -> float:
    """Largest error of the amplitude in counts: by truncation, and by the residual gain."""
    return 1.5 + 0.00015 * radius


def quarter_bound(plans: Mapping[int, Plan], w: int) -> float:
    """The bound of the phase error from a quarter of full scale on, in LSB."""
    return bound(plans[w], w, (1 << w - 1) / 4, plans is ITERATIVE)


def fraction_bits(plan: Plan) -> list[tuple[int, int]]:
    """Per step of arctan_pipelined from 0 on: the fraction bits of (longer, shorter) after it; a
    negative number counts integer bits that are dropped. Step 1 folds the sample, step t finds
    digit t - 1.
    """
    turns, digits, head, _ = plan
    longer, shorter, found = 1, 0, [(0, 0), (0, 0), (1, 0)]
    for digit in range(2, digits):
        before = longer
        if digit <= turns:
            longer = min(max(longer, shorter + 2 * digit - 1), head - digit - 2)
        shorter = min(max(before, shorter - 1), head - digit - 1)
        found.append((longer if digit < turns else min(longer, shorter), shorter))
    return found


def summed(plan: Plan) -> list[int]:
    """Per step of arctan_pipelined from 0 on: the digits whose angles are in the sum after it. A
    step adds only digits that an earlier step has found.
    """
    ends = [0] + [first + count - 1 for first, count in groups(plan[1])[:-1]]
    return [max(end for end in ends if end <= max(step - 2, 0)) for step in range(plan[1] + 1)]


def chosen(number: int, plans: Mapping[int, Plan], name: str) -> str:
    """A parameter of the plan as a constant that depends on W; the last width stands for the wider
    ones.
    """
    value = {w: plan[number] for w, plan in plans.items()}
    cases = "".join(f"W == {w} ? {value[w]} : " for w in (8, 9, 10))
    return f"    localparam int {name} = {cases}{value[16]};"


def rows(name: str, steps_of: Callable[[Plan], list[int]]) -> tuple[list[str], int]:
    """A table of one row per width, one signed byte per step, step 0 at the right."""
    length = max(plan[1] for plan in PIPELINED.values()) + 1
    lines = []
    for w in reversed(PIPELINED):
        steps = steps_of(PIPELINED[w])
        word = "".join(f"{n % 256:02x}" for n in reversed(steps + [0] * (length - len(steps))))
        lines.append(f"        {8 * length}'h{word}{',' if w > 8 else ''}  // W = {w}")
    size = f"{len(PIPELINED)}*{8 * length}-1"
    return [f"    localparam [{size}:0] {name} = {{", *lines, "    };"], 8 * length


def pipelined_constants() -> list[str]:
    longer, row = rows("LONGER", lambda plan: [bits for bits, _ in fraction_bits(plan)])
    shorter, _ = rows("SHORTER", lambda plan: [bits for _, bits in fraction_bits(plan)])
    sums, _ = rows("SUMMED", summed)
    return [
        *(
            chosen(number, PIPELINED, name)
            for number, name in enumerate(("TURNS", "DIGITS", "HEAD", "GUARD"))
            if name != "HEAD"
        ),
        f"    localparam int ROW = {row} * (W - 8);  // one row per W, one signed byte per step",
        "    // fraction bits of longer after each step, step 0 at the right",
        "    // (a negative number: integer bits that are dropped)",
        *longer,
        "    // fraction bits of shorter after each step",
        *shorter,
        "    // digits whose angles are in the sum after each step",
        *sums,
    ]


def iterative_constants() -> list[str]:
    names = ("TURNS", "DIGITS", "F", "GUARD")
    return [chosen(number, ITERATIVE, name) for number, name in enumerate(names)]


def made() -> dict[Path, str]:
    modules = {"arctan_pipelined": pipelined_constants(), "arctan_iterative": iterative_constants()}
    return {MADE: text()} | {
        path: made_files.filled(path, BEGIN, END, lines)
        for path, lines in ((FOLDER / f"{name}.sv", lines) for name, lines in modules.items())
    }


def text() -> str:
    top = LONGEST
    cases = "\n".join(
        f"                {f'{i}:':<8} angle = 64'd{ANGLE[i - 1]};" for i in range(1, LONGEST + 1)
    )
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// arctan_rotation_rom -- the sum of the angles of a few digits of a rotation; made by
// tables/arctan_rotation.py, not to be edited.
//
// latency  0 cycles from negative to sum: a table without a register
// rate     one sum per cycle
// source   digit i rotates by atan(2^-i) up to TURNS, by (1 - 2^-2(TURNS + 1)) 2^-i after it
// model    entry() of tables/arctan_rotation.py
//
// The angles are in 2^-{UNIT} turn. A sum from digit 1 on is truncated and includes half an LSB for
// rounding the phase; the others are rounded.
`default_nettype none

module arctan_rotation_rom #(
    parameter  int TURNS = 6,                  // digits that rotate by an arctangent, up to {top}
    parameter  int FIRST = 1,                  // the first digit of the sum
    parameter  int COUNT = 4,                  // digits in the sum, 1 to 5
    parameter  int GUARD = 9,                  // bits below the LSB of a {PHASE}-bit phase
    localparam int B     = {PHASE} + GUARD - FIRST  // bits of the sum
) (
    input  wire         [COUNT-1:0] negative,  // one bit per digit, digit FIRST is bit 0
    output logic signed [    B-1:0] sum        // 2^-GUARD LSB of phase
);
    if (TURNS < 1 || TURNS > {LONGEST}) begin : g_check_turns
        TURNS_MUST_BE_FROM_1_TO_{LONGEST} u_error ();
    end
    if (COUNT < 1 || COUNT > 5) begin : g_check_count
        COUNT_MUST_BE_FROM_1_TO_5 u_error ();
    end

    localparam int CUT = {UNIT - PHASE} - GUARD;
    localparam [63:0] RADIAN = 64'd{RADIAN};

    function [63:0] angle(input int digit);
        if (digit > TURNS) angle = (RADIAN - (RADIAN >> (2 * TURNS + 2))) >> digit;
        else
            case (digit)
{cases}
                default: angle = 64'd0;
            endcase
    endfunction

    localparam [63:0] HALF = 64'd1 << (FIRST == 1 ? {UNIT - PHASE - 1} : CUT - 1);
    localparam [63:0] A0 = angle(FIRST);
    localparam [63:0] A1 = COUNT > 1 ? angle(FIRST + 1) : 64'd0;
    localparam [63:0] A2 = COUNT > 2 ? angle(FIRST + 2) : 64'd0;
    localparam [63:0] A3 = COUNT > 3 ? angle(FIRST + 3) : 64'd0;
    localparam [63:0] A4 = COUNT > 4 ? angle(FIRST + 4) : 64'd0;

    wire [B-1:0] row[0:(1<<COUNT)-1];
    for (genvar n = 0; n < 1 << COUNT; n++) begin : g_row
        localparam [63:0] S0 = n % 2 > 0 ? HALF - A0 : HALF + A0;
        localparam [63:0] S1 = n / 2 % 2 > 0 ? S0 - A1 : S0 + A1;
        localparam [63:0] S2 = n / 4 % 2 > 0 ? S1 - A2 : S1 + A2;
        localparam [63:0] S3 = n / 8 % 2 > 0 ? S2 - A3 : S2 + A3;
        localparam [63:0] S4 = n / 16 > 0 ? S3 - A4 : S3 + A4;
        assign row[n] = B'(S4 >> CUT);
    end

    assign sum = $signed(row[negative]);
endmodule

`default_nettype wire
"""


def bounds() -> str:
    return "\n".join(
        f"{w} bits: pipelined {quarter_bound(PIPELINED, w):.3f}, "
        f"iterative {quarter_bound(ITERATIVE, w):.3f} LSB"
        for w in PIPELINED
    )


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments, bounds)


if __name__ == "__main__":
    sys.exit(main())

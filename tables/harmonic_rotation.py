# SPDX-License-Identifier: Apache-2.0
"""Make rtl/compensate/harmonic_rotation_rom.sv: the angles by which harmonic_map rotates a vector,
in 2^-32 turn.

Rotation n turns by atan(2^-n), so that it needs only shifts and additions (CORDIC).
"""

import sys
from fractions import Fraction

from tables import made_files
from tables.made_files import ROOT

UNIT = 32  # the made angles are in 2^-UNIT turn
COUNT = 24  # rotations
MADE = ROOT / "rtl" / "compensate" / "harmonic_rotation_rom.sv"


def arctan(inverse: int) -> Fraction:
    """atan(1 / inverse) for an inverse from 2 up, by its series, right to far below 2^-UNIT."""
    total, term, k = Fraction(0), Fraction(1, inverse), 0
    while term > Fraction(1, 1 << UNIT + 40):
        total += (-1) ** k * term / (2 * k + 1)
        term /= inverse * inverse
        k += 1
    return total


def angles() -> list[int]:
    """The angles of all rotations in whole 2^-UNIT turn, without floating point."""
    eighth = 4 * arctan(5) - arctan(239)  # a quarter of pi, by Machin's formula
    radians = [eighth] + [arctan(1 << n) for n in range(1, COUNT)]
    return [round(angle / (8 * eighth) * (1 << UNIT)) for angle in radians]


def text() -> str:
    *most, last = angles()
    cases = "\n".join(f"            5'd{n}: angle = 32'd{a};" for n, a in enumerate(most))
    return f"""\
// SPDX-License-Identifier: Apache-2.0
// harmonic_rotation_rom -- look up the angle of each rotation of harmonic_map.
//
// latency   0 cycles: combinational
// source    Rotation n turns by atan(2^-n), rounded to 2^-{UNIT} turn.
// model     angles() of tables/harmonic_rotation.py
// made      by tables/harmonic_rotation.py, not to be edited
`default_nettype none

module harmonic_rotation_rom (
    input  wire  [ 4:0] rotation,  // number of the rotation, 0 to {COUNT - 1}
    output logic [31:0] angle      // 2^-{UNIT} turn
);
    always_comb begin
        case (rotation)
{cases}
            default: angle = 32'd{last};
        endcase
    end
endmodule

`default_nettype wire
"""


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, lambda: {MADE: text()}, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Fill in the constant of drive_interlock: which faults latch even while the drive is off.

The bits of the faults are those of the register axis.faults in tables/registers.rdl.

python -m tables.interlock_faults [--check]
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from tables import made_files, registers

MODULE = made_files.ROOT / "rtl" / "interlock" / "drive_interlock.sv"
BEGIN = "    // made by tables/interlock_faults.py, not to be edited"
END = "    // end of the made constants"
ALWAYS = ("estop", "drive", "cpu")  # the faults that latch with the drive off, too


def made() -> dict[Path, str]:
    """{file: its text}."""
    axis = next(block for block in registers.read() if block.name == "axis")
    fields = next(register for register in axis.registers if register.name == "faults").fields
    mask = sum(1 << field.low for field in fields if field.name in ALWAYS)
    if mask.bit_count() != len(ALWAYS):
        raise ValueError(f"the register axis.faults must have the fields {', '.join(ALWAYS)}")
    width, names = len(fields), ", ".join(ALWAYS)
    line = f"    localparam [{width - 1}:0] LATCH_ALWAYS = {width}'b{mask:0{width}b};  // {names}"
    return {MODULE: made_files.filled(MODULE, BEGIN, END, [line])}


def main(arguments: Sequence[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())

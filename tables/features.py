# SPDX-License-Identifier: Apache-2.0
"""Makes the table of docs/features.md, what a feature costs, from the record of figures and from
sw/boards/size.py, the sizes by which a node is estimated before its synthesis.
"""

import sys
from pathlib import Path

from boards import size
from tables import made_files

PAGE = made_files.ROOT / "docs" / "features.md"
BEGIN, END = "<!-- made by tables/features.py: costs -->", "<!-- end of costs -->"
NAMES = {
    "segments": "segment table of 255 segments",
    "monitor": "signal monitor",
    "fine_stage": "fine stage",
    "capture": "capture queue",
    "encoder_check": "check of the encoder",
    "backlash": "compensation of backlash",
}  # of features; the others are called as they are named


def rows() -> dict[str, int]:
    """LUT4 of an ECP5 by what takes them, in the order of the table."""
    axis, drive = "a further axis with", "profile, servo, interlock"
    features = {NAMES.get(name, name): lut for name, lut in size.FEATURES.items()}
    return {
        f"{axis} A/B/Z, homing, {drive} and step generator": size.STEP_AXIS,
        f"{axis} sine and cosine, correction, harmonics, {drive}, PWM and DAC": size.SINE_AXIS,
        "a node of two of these step axes, with soft core, bus and motion engine": size.STEP_NODE,
        "a node of two of these sine axes": size.SINE_NODE,
        **features,
        "step generator": size.STEPPER,
        "set-points of one axis": size.SET_POINTS,
        "set-points of each further axis": size.SET_POINTS_AXIS,
        "real-time link": size.LINK,
    }


def make() -> dict[Path, str]:
    table = ["| | LUT4 |", "| --- | --- |"]
    table += [f"| {words} | {lut} |" for words, lut in rows().items()]
    return {PAGE: made_files.filled(PAGE, BEGIN, END, ["", *table, ""])}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

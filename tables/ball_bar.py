# SPDX-License-Identifier: Apache-2.0
"""Makes the table of the circles in docs/linuxcnc.md from docs/ball_bar.toml, which
`python -m linuxcnc_config.ball_bar --record docs` writes.
"""

import sys
import tomllib
from pathlib import Path

from tables import made_files

PAGE = made_files.ROOT / "docs" / "linuxcnc.md"
RECORD = made_files.ROOT / "docs" / "ball_bar.toml"
COLUMNS = {  # {key of the record: head of its column}
    "deviation": "G(b)",
    "counterclockwise": "G, counterclockwise",
    "clockwise": "G, clockwise",
    "hysteresis": "H",
    "radial": "F",
    "rms": "rms",
}
BEGIN, END = "<!-- made by tables/ball_bar.py: circles -->", "<!-- end of circles -->"


def make() -> dict[Path, str]:
    record = tomllib.loads(RECORD.read_text(encoding="utf-8"))
    rows = [
        f"| {name} | " + " | ".join(f"{values[key]:.2f}" for key in COLUMNS) + " |"
        for name, values in record.items()
    ]
    head = ["", f"| in µm | {' | '.join(COLUMNS.values())} |", "| --- |" + " --- |" * len(COLUMNS)]
    return {PAGE: made_files.filled(PAGE, BEGIN, END, [*head, *rows, ""])}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

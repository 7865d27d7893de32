# SPDX-License-Identifier: Apache-2.0
"""Makes the table of effects in docs/world.md: what the stage has in a typical and a bad world,
from sw/twin/parameters/stage.toml.
"""

import sys
from pathlib import Path

from tables import made_files
from twin.parameters.tables import load, world

PAGE = made_files.ROOT / "docs" / "world.md"
BEGIN = "<!-- Made by tables/effects.py from sw/twin/parameters/stage.toml: do not edit. -->"
END = "<!-- End of the made table. -->"


def rows(machine: str = "stage") -> list[str]:
    typical, bad = world("typical", machine), world("bad", machine)
    found = [
        f"| `{name}` | {load(machine)[name]['value']:g} | {typical[name]:g} | {bad[name]:g} | "
        f"{load(machine)[name]['unit']} | {load(machine)[name]['why']} |"
        for name in bad
    ]
    return [
        "",
        "| parameter | as it stands | typical | bad | unit | source or reason |",
        "| --- | --- | --- | --- | --- | --- |",
        *found,
        "",
    ]


def make() -> dict[Path, str | None]:
    return {PAGE: made_files.filled(PAGE, BEGIN, END, rows())}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

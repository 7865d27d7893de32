# SPDX-License-Identifier: Apache-2.0
"""Makes the tables of effects in docs/world.md: what a machine has in a typical and a bad world,
from sw/twin/parameters/*.toml.
"""

import sys
from pathlib import Path

from tables import made_files
from twin.parameters.tables import load, world

PAGE = made_files.ROOT / "docs" / "world.md"
MACHINES = {"stage": "The stage of S0", "rotary_ring": "The ring of S1"}
BEGIN = "<!-- Made by tables/effects.py from sw/twin/parameters/*.toml: do not edit. -->"
END = "<!-- End of the made table. -->"


def rows(machine: str) -> list[str]:
    typical, bad = world("typical", machine), world("bad", machine)
    found = [
        f"| `{name}` | {load(machine)[name]['value']:g} | {typical[name]:g} | {bad[name]:g} | "
        f"{load(machine)[name]['unit']} | {load(machine)[name]['why']} |"
        for name in bad
    ]
    return [
        "",
        f"## {MACHINES[machine]}",
        "",
        "| parameter | as it stands | typical | bad | unit | source or reason |",
        "| --- | --- | --- | --- | --- | --- |",
        *found,
        "",
    ]


def make() -> dict[Path, str | None]:
    tables = [row for machine in MACHINES for row in rows(machine)]
    return {PAGE: made_files.filled(PAGE, BEGIN, END, tables)}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

# SPDX-License-Identifier: Apache-2.0
"""Makes the tables of effects: what a machine has in a typical and a bad world, from
sw/twin/parameters. The stage and the ring are in docs/world.md, the linear motor in
docs/homing.md.
"""

import sys
from pathlib import Path

from tables import made_files
from twin.parameters.tables import load, world

PAGES = {  # {page: {machine: title}}
    "world.md": {"stage": "The stage of S0", "rotary_ring": "The ring of S1"},
    "homing.md": {"linear_motor": "The motor of S3"},
}
BEGIN = "<!-- Made by tables/effects.py from sw/twin/parameters/*.toml: do not edit. -->"
END = "<!-- End of the made table. -->"


def rows(machine: str, title: str) -> list[str]:
    typical, bad = world("typical", machine), world("bad", machine)
    found = [
        f"| `{name}` | {load(machine)[name]['value']:g} | {typical[name]:g} | {bad[name]:g} | "
        f"{load(machine)[name]['unit']} | {load(machine)[name]['why']} |"
        for name in bad
    ]
    return [
        "",
        f"## {title}",
        "",
        "| parameter | as it stands | typical | bad | unit | source or reason |",
        "| --- | --- | --- | --- | --- | --- |",
        *found,
        "",
    ]


def make() -> dict[Path, str | None]:
    made: dict[Path, str | None] = {}
    for name, machines in PAGES.items():
        page = made_files.ROOT / "docs" / name
        tables = [row for machine, title in machines.items() for row in rows(machine, title)]
        made[page] = made_files.filled(page, BEGIN, END, tables)
    return made


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

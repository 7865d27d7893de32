# SPDX-License-Identifier: Apache-2.0
"""Makes the tables of effects: what a machine has in a typical and a bad world, from
sw/twin/parameters. The stage is in docs/world.md, the linear motor in docs/homing.md.
"""

import sys
from pathlib import Path

from tables import made_files
from twin.parameters.tables import load, world

PAGES = {"stage": "world.md", "linear_motor": "homing.md"}
BEGIN = "<!-- Made by tables/effects.py from sw/twin/parameters/{}.toml: do not edit. -->"
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
        "| parameter | as it stands | typical | bad | unit | source or reason |",
        "| --- | --- | --- | --- | --- | --- |",
        *found,
        "",
    ]


def make() -> dict[Path, str | None]:
    pages = {machine: made_files.ROOT / "docs" / name for machine, name in PAGES.items()}
    return {
        page: made_files.filled(page, BEGIN.format(machine), END, rows(machine))
        for machine, page in pages.items()
    }


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

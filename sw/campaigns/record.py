# SPDX-License-Identifier: Apache-2.0
"""docs/mutants.toml, docs/wiring.toml and docs/seeds.toml: which parts of long tests have been run,
and what they have found. A part is added as soon as it ends, so that the next run goes on.
"""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from twin.build import ROOT

MUTANTS = ROOT / "docs" / "mutants.toml"  # of blocks and sources
WIRING = ROOT / "docs" / "wiring.toml"  # of the instances of the block diagrams
SEEDS = ROOT / "docs" / "seeds.toml"  # of the figures that draw random numbers
HEADS = {
    MUTANTS: """\
# SPDX-License-Identifier: Apache-2.0
# Which mutants of which blocks and sources have been run, and what no test sees. Written by
# `python -m mutation.blocks --record`, and the same with `mutation.host` and `mutation.firmware`;
# docs/mutation.md says how to read it.
""",
    WIRING: """\
# SPDX-License-Identifier: Apache-2.0
# The faults in the connections of which instances have been run, and which of them no test sees.
# Written by `make figure NAME=wiring_survivors` and `python -m mutation.wiring_record`;
# docs/wiring.md says how to read it.
""",
    SEEDS: """\
# SPDX-License-Identifier: Apache-2.0
# What each figure that draws random numbers was with each of its seeds, and which measurements
# missed its bound. Written by `make figure NAME=seeds_failed` and `python -m figures.seeds`;
# docs/campaigns.md says how to read it.
""",
}
Entry = Mapping[str, int | str | Sequence[str] | Sequence[float]]


def read(path: Path) -> dict[str, dict[str, Any]]:
    """The entries of a record, by name."""
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def add(name: str, entry: Entry, path: Path) -> None:
    """Add the entry of this name, with today's date, in place of an older one."""
    known = read(path)
    known[name] = {"date": date.today(), **entry}
    lines = [HEADS[path]]
    for key, values in sorted(known.items()):
        lines.append(f"[{key}]" if re.fullmatch(r"\w+", key) else f'["{key}"]')
        for what, value in values.items():
            if isinstance(value, list) and all(isinstance(text, str) for text in value):
                inside = "".join(f"    {json.dumps(text, ensure_ascii=False)},\n" for text in value)
                lines.append(f"{what} = [\n{inside}]" if value else f"{what} = []")
            else:
                said = json.dumps(value) if isinstance(value, str) else value
                lines.append(f"{what} = {said}")
        lines.append("")
    path.write_text("\n".join(lines).rstrip("\n") + "\n", encoding="utf-8")

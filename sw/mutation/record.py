# SPDX-License-Identifier: Apache-2.0
"""docs/mutants.toml: which mutants have been run, and what no test sees."""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from datetime import date

from twin.build import ROOT

RECORD = ROOT / "docs" / "mutants.toml"
HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# Which mutants of which blocks and sources have been run, and what no test sees. Written by
# `python -m mutation.blocks --record`, and the same with `mutation.host` and `mutation.firmware`;
# docs/mutation.md says how to read it.
"""
Entry = Mapping[str, int | Sequence[str]]


def add(name: str, entry: Entry) -> None:
    """Add the entry of a block or module, with today's date, in place of an older one."""
    known = tomllib.loads(RECORD.read_text()) if RECORD.exists() else {}
    known[name] = {"date": date.today(), **entry}
    lines = [HEAD]
    for key, values in sorted(known.items()):
        lines.append(f"[{key}]" if re.fullmatch(r"\w+", key) else f'["{key}"]')
        for what, value in values.items():
            if isinstance(value, list):
                inside = "".join(f"    {json.dumps(text, ensure_ascii=False)},\n" for text in value)
                lines.append(f"{what} = [\n{inside}]" if value else f"{what} = []")
            else:
                lines.append(f"{what} = {value}")
        lines.append("")
    RECORD.write_text("\n".join(lines).rstrip("\n") + "\n", encoding="utf-8")

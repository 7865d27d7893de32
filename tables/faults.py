# SPDX-License-Identifier: Apache-2.0
"""Makes docs/faults.md, each fault and cause with its meaning and what to do, from
tables/bus.toml (the words) and sw/host/moire/client/remedies.py (what to do).
"""

import sys
from pathlib import Path

from moire.client import remedies
from tables import made_files
from tables.made_files import ROOT

PAGE = ROOT / "docs" / "faults.md"
HEAD = """\
<!-- SPDX-License-Identifier: Apache-2.0 -->
<!-- Made by tables/faults.py from tables/bus.toml and sw/host/moire/client/remedies.py: do not \
edit. -->
# Faults and causes

A *fault* is latched by the interlock and switches the drive off. A *cause* says why a node \
refuses a request, or how a motion ended.
`moire fault` shows the faults of an axis, `moire fault NAME` explains one of these names, and \
the live page and HTTP show the same words.
What is wrong with sine and cosine is on a [page of its own](signal_faults.md).
"""
TITLES = {
    "fault": "Faults",
    "event of the encoder": "Events of the encoder",
    "cause": "Causes",
    "reason of the calibration": "Why a calibration makes no progress",
}


def section(what: str) -> list[str]:
    """The table of one kind of names."""
    found, words = remedies.TABLES[what]
    rows = [
        f"| `{name}` | {meaning} | {found[name]} | {parameters(found[name])} |"
        for name, meaning in words.values()
        if name in found
    ]
    head = ["| name | meaning | what to check and do | parameters |", "| --- | --- | --- | --- |"]
    return ["", f"## {TITLES[what]}", "", *head, *rows]


def parameters(text: str) -> str:
    """The parameters that a text names."""
    return " ".join(f"`{name}`" for name in remedies.parameters_in(text))


def made() -> dict[Path, str | None]:
    """{path: text}"""
    lines = [line for what in remedies.TABLES for line in section(what)]
    return {PAGE: HEAD + "\n".join([*lines, ""])}


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())

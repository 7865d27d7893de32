# SPDX-License-Identifier: Apache-2.0
"""The record of the figures, docs/figures.toml: what was measured last, when and on which machine.

A measurement in full and with the default seed writes it; README's table is made from it by
tables/readme_figures.py.
"""

import os
import platform
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from figures.common import Figure
from twin.build import ROOT

RECORD = ROOT / "docs" / "figures.toml"
HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# What each figure was when it was measured last. Written by `make figures` and `make figure NAME=…`
# alone; README's table is made from it by `make tables`.
"""


@dataclass(frozen=True)
class Entry:
    value: float
    unit: str
    bound: str
    date: date
    machine: str


def machine() -> str:
    """This machine, in words: what matters to the figures that are times."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        names = [line.split(":", 1)[1] for line in text.splitlines() if "model name" in line]
    except OSError:
        names = []
    name = (names or [platform.machine()])[0].strip()
    return f"{os.cpu_count()} cores, {name}"


def entry_of(figure: Figure, value: float) -> Entry:
    """Of a value that has just been measured here."""
    rounded = float(f"{value:.{figure.digits}f}")
    return Entry(rounded, figure.unit, figure.bound, date.today(), machine())


def read(path: Path = RECORD) -> dict[str, Entry]:
    entries = tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {name: Entry(**entry) for name, entry in entries.items()}


def text_of(entries: Mapping[str, Entry]) -> str:
    lines = [HEAD]
    for name, entry in entries.items():
        lines += [
            f"[{name}]",
            f"value = {entry.value!r}",
            f'unit = "{entry.unit}"',
            f'bound = "{entry.bound}"',
            f"date = {entry.date.isoformat()}",
            f'machine = "{entry.machine}"',
            "",
        ]
    return "\n".join(lines)


def add(new: Mapping[str, Entry], order: Iterable[str], path: Path = RECORD) -> None:
    """Writes these entries into the record, which holds the figures of `order` in that order."""
    entries = {**read(path), **new}
    path.write_text(text_of({name: entries[name] for name in order if name in entries}), "utf-8")

# SPDX-License-Identifier: Apache-2.0
"""Makes the table of figures in README.md from their definitions in sw/figures and the record of
what was measured last, docs/figures.toml.
"""

import sys
from importlib import import_module
from pathlib import Path

from figures.common import Figure, modules
from figures.comparison import number, typeset
from figures.record import RECORD, Entry, read
from tables import made_files

README = made_files.ROOT / "README.md"
BEGIN = "<!-- Made by tables/readme_figures.py from docs/figures.toml: do not edit. -->\n"
END = "<!-- End of the made table. -->\n"
FIRST = (  # the modules of sw/figures in the order of the table; others follow
    "s0",
    "area",
    "fine",
    "calibration",
    "legacy",
    "arctan",
    "interpolate",
    "decoder",
    "faults",
    "interlock",
    "profile",
    "steps",
    "s1",
    "relay",
    "s2s3",
    "s4",
    "ps2",
    "job",
    "bus",
    "gateway",
    "full_clock",
    "twin_speed",
)


def cell(text: str) -> str:
    """A text as a cell of a table in Markdown, typeset; bars of magnitudes would end the cell."""
    text = typeset(text)
    return text.replace("|target − true position|", "target − true position").replace("|", "\\|")


def collected() -> dict[str, Figure]:
    """All figures, in the order of the table."""
    order = [*FIRST, *(name for name in modules() if name not in FIRST)]
    found: dict[str, Figure] = {}
    for module in order:
        found |= getattr(import_module(f"figures.{module}"), "FIGURES", {})
    return found


def row(name: str, figure: Figure, entry: Entry | None) -> str:
    if entry is None:
        measured = "not measured yet"
    else:
        measured = cell(f"{number(entry.value, figure.digits)} {entry.unit}".strip())
    return f"| `{name}`: {cell(figure.what)} | {measured} | {cell(figure.bound_words)} |"


def sources(entries: dict[str, Entry]) -> str:
    """When and where the values were measured."""
    places: dict[str, set[str]] = {}
    for entry in entries.values():
        places.setdefault(entry.machine, set()).add(entry.date.isoformat())
    parts = []
    for machine, dates in places.items():
        first, last = min(dates), max(dates)
        parts.append(f"{first} to {last}" if first != last else first)
        parts[-1] += f" on {machine}"
    return "Measured " + "; ".join(parts) + "."


def table(figures: dict[str, Figure], entries: dict[str, Entry]) -> str:
    if unknown := sorted(set(entries) - set(figures)):
        raise ValueError(f"{RECORD.name}: there is no figure {unknown[0]}")
    for name, entry in entries.items():
        if (entry.unit, entry.bound) != (figures[name].unit, figures[name].bound):
            raise ValueError(f"{RECORD.name}: {name} has another unit or bound: measure it again")
    rows = [row(name, figure, entries.get(name)) for name, figure in figures.items()]
    head = ["| figure | measured | bound |", "| --- | --- | --- |"]
    return "\n".join([sources(entries), "", *head, *rows, ""])


def make() -> dict[Path, str]:
    text = README.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ValueError(f"{README.name}: the marks of the table of figures are missing")
    begin, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    return {README: text[:begin] + "\n" + table(collected(), read()) + "\n" + text[end:]}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__, make))

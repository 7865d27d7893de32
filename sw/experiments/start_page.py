# SPDX-License-Identifier: Apache-2.0
"""The start page of all reports, build/report/index.html: what each experiment has shown, what its
model leaves out, and the command that makes a report that is not there yet.

    python -m experiments.start_page

Each experiment writes it again after its own report.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from html.parser import HTMLParser
from pathlib import Path

from experiments.report_page import render
from moire.analysis import report
from twin.build import ROOT

FOLDER = ROOT / "build" / "report"
PYTHON = "build/venv/bin/python -m"
REPORTS = {  # name of the file: (title, command)
    "s0_stage": ("S0: X-Y stage with a grating interferometer", "make demo"),
    "s0_fine": ("S0: coarse and fine together", f"{PYTHON} experiments.s0_fine"),
    "s1_ring": ("S1: circular grating, corrected on the fly", f"{PYTHON} experiments.s1_ring"),
    "s2_stage": ("S2: three axes with direct scale input", f"{PYTHON} experiments.s2_stage"),
    "s3_zero": ("S3: zero point of a linear motor", f"{PYTHON} experiments.s3_zero"),
    "s4_job": ("S4: the unattended indexing machine", f"{PYTHON} experiments.s4_job"),
    "figures": ("All figures of the project", "make figures"),
}


@dataclass(frozen=True)
class Entry:
    """One report on the start page."""

    name: str
    title: str
    command: str
    found: bool = False
    claim: str = ""
    left_out: str = ""
    written: str = ""


class Head(HTMLParser):
    """The meta elements of a page, by their names."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.contents: dict[str, str] = {}
        self.feed(text.partition("</head>")[0])

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called by HTMLParser."""
        values = dict(attrs)
        if tag == "meta" and values.get("name"):
            self.contents[values["name"] or ""] = values.get("content") or ""


def entry(folder: Path, name: str) -> Entry:
    """What the report of this name says of itself."""
    title, command = REPORTS[name]
    path = folder / f"{name}.html"
    if not path.is_file():
        return Entry(name, title, command)
    contents = Head(path.read_text(encoding="utf-8")).contents
    written = datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    claim, left_out = contents.get("description", ""), contents.get("left-out", "")
    return Entry(name, title, command, True, claim, left_out, written)


def write(folder: Path = FOLDER) -> Path:
    """Writes the start page of the reports in this folder; returns its path, raises BadFile."""
    text = render(
        "start.html",
        title="Moire: reports of the experiments",
        summary="Each experiment runs a machine of a paper in the twin: the RTL and the firmware "
        "as they ship, closed around a model of the machine.",
        reports=[entry(folder, name) for name in REPORTS],
    )
    return report.write_text(folder / "index.html", str(text))


def publish(name: str, text: str, folder: Path = FOLDER) -> Path:
    """Writes the report of an experiment and the start page; returns the path of the report, raises
    BadFile.
    """
    path = report.write_text(folder / f"{name}.html", text)
    write(folder)
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Writes the start page."""
    print(write())
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Measure a named figure afresh on this machine; the last line printed is `name value unit`.

    python -m figures.figure NAME         (make figure NAME=…)
    python -m figures.figure NAME NAME …  (these, and build/report/figures.html of them)
    python -m figures.figure --all        (make figures: all of them, and the page)
    python -m figures.figure --list

The exit code is 0 when the figure is what is wanted of it, 1 when it is not.
"""

import argparse
import sys
import time
from pathlib import Path

from figures.common import collected, console
from figures.comparison import page
from figures.synthesis import SynthesisError
from moire.errors import MoireError
from twin import BuildError

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "build" / "report" / "figures.html"


def measure(name, figure):
    """(value, seconds); says on standard error what it means, on standard output the line."""
    began = time.perf_counter()
    value = figure.measure()
    took = time.perf_counter() - began
    verdict = "[green]reached[/]" if figure.good(value) else "[red]not reached[/]"
    console.print(f"{figure.what}: wanted {figure.wanted}, {verdict}; measured in {took:.0f} s")
    print(f"{name} {value:.{figure.digits}f} {figure.unit}", flush=True)
    return value, took


def main(arguments=None):
    figures = collected("FIGURES")
    parser = argparse.ArgumentParser(
        prog="python -m figures.figure", description="Measure a figure afresh on this machine."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a figure; see --list")
    parser.add_argument(
        "--all", action="store_true", help="measure all, and write build/report/figures.html"
    )
    parser.add_argument("--list", action="store_true", help="say which figures there are")
    options = parser.parse_args(arguments)
    if options.list:
        for name, figure in figures.items():
            print(f"{name:24} {figure.what}; wanted: {figure.wanted}")
        return 0
    if unknown := [name for name in options.names if name not in figures]:
        parser.error(f"there is no figure {unknown[0]}: there are {', '.join(figures)}")
    names = list(figures) if options.all else options.names
    if not names:
        parser.error(f"which figure? There are {', '.join(figures)}")
    rows = []
    for name in names:
        if len(names) > 1:
            console.rule(name)
        try:
            rows.append((name, figures[name], *measure(name, figures[name])))
        except (MoireError, BuildError, SynthesisError) as error:
            print(f"{name}: {error}", file=sys.stderr)
            rows.append((name, figures[name], None, str(error)))
    if len(names) > 1:
        PAGE.parent.mkdir(parents=True, exist_ok=True)
        PAGE.write_text(page(rows), encoding="utf-8")
        console.print(f"page: {PAGE}", soft_wrap=True)
    return 0 if all(value is not None and figure.good(value) for _, figure, value, _ in rows) else 1


if __name__ == "__main__":
    sys.exit(main())

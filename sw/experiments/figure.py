# SPDX-License-Identifier: Apache-2.0
"""Measure a named figure afresh on this machine; the last line printed is `name value unit`.

    python -m experiments.figure NAME         (make figure NAME=…)
    python -m experiments.figure --all        (make figures: all of them, and build/report/figures.html)
    python -m experiments.figure --list

The exit code is 0 when the figure is what is wanted of it, 1 when it is not.
"""
import argparse
import html
import sys
import time
from importlib import import_module
from pathlib import Path

from experiments.figures_common import console
from experiments.synthesis import SynthesisError
from moire.errors import MoireError
from moire.report import STYLE
from twin import BuildError

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "build" / "report" / "figures.html"


def all_figures():
    """Those of every figures_*.py beside this file."""
    found = {}
    for path in sorted(Path(__file__).parent.glob("figures_*.py")):
        found |= getattr(import_module(f"experiments.{path.stem}"), "FIGURES", {})
    return found


def measure(name, figure):
    """(value, seconds); says on standard error what it means, on standard output the line."""
    began = time.perf_counter()
    value = figure.measure()
    took = time.perf_counter() - began
    verdict = "[green]reached[/]" if figure.good(value) else "[red]not reached[/]"
    console.print(f"{figure.what}: wanted {figure.wanted}, {verdict}; measured in {took:.0f} s")
    print(f"{name} {value:.{figure.digits}f} {figure.unit}", flush=True)
    return value, took


def page(rows):
    """rows: (name, figure, value or None, seconds or the error)."""
    lines = []
    for name, figure, value, took in rows:
        if value is None:
            told, kind = f"failed: {took}", "bad"
        else:
            told, kind = f"{value:.{figure.digits}f} {figure.unit}", "good" if figure.good(value) else "bad"
        cells = [html.escape(text) for text in (name, figure.what, figure.wanted)]
        seconds = f"{took:.0f} s" if value is not None else ""
        lines.append("<tr>" + "".join(f"<td class=text>{cell}</td>" for cell in cells)
                     + f'<td class="{kind}">{html.escape(told)}</td><td>{seconds}</td></tr>')
    return (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Moire: figures</title><style>\n{STYLE}</style></head>'
            "<body><main><h1>Figures, measured afresh</h1><section><table><thead><tr><th class=text>name</th><th class=text>what</th>"
            "<th class=text>wanted</th><th>measured</th><th>took</th></tr></thead><tbody>\n" + "\n".join(lines)
            + "\n</tbody></table></section></main></body></html>\n")


def main(arguments=None):
    figures = all_figures()
    parser = argparse.ArgumentParser(prog="python -m experiments.figure", description="Measure a figure afresh on this machine.")
    parser.add_argument("name", nargs="?", help="of the figure; see --list")
    parser.add_argument("--all", action="store_true", help="measure all, and write build/report/figures.html")
    parser.add_argument("--list", action="store_true", help="say which figures there are")
    options = parser.parse_args(arguments)
    if options.list:
        for name, figure in figures.items():
            print(f"{name:24} {figure.what}; wanted: {figure.wanted}")
        return 0
    if options.all:
        rows = []
        for name, figure in figures.items():
            console.rule(name)
            try:
                rows.append((name, figure, *measure(name, figure)))
            except (MoireError, BuildError, SynthesisError) as error:
                console.print(f"{name}: {error}")
                rows.append((name, figure, None, str(error)))
        PAGE.parent.mkdir(parents=True, exist_ok=True)
        PAGE.write_text(page(rows), encoding="utf-8")
        console.print(f"page: {PAGE}", soft_wrap=True)
        return 0 if all(value is not None and figure.good(value) for _, figure, value, _ in rows) else 1
    if options.name not in figures:
        parser.error(f"{f'there is no figure {options.name}' if options.name else 'which figure?'}: there are {', '.join(figures)}")
    try:
        value, _ = measure(options.name, figures[options.name])
    except (MoireError, BuildError, SynthesisError) as error:
        print(f"{options.name}: {error}", file=sys.stderr)
        return 1
    return 0 if figures[options.name].good(value) else 1


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Measure named figures on this machine; the last line printed of each is `name value unit`.

    python -m figures.figure NAME …       (make figure NAME=…)
    python -m figures.figure --all        (make figures: all of them, and build/report/figures.html)
    python -m figures.figure --list

Each value goes into docs/figures.toml, unless it was measured with --quick (the short forms, which
check that each figure yields a number; with --all two modules at a time), another --seed, or
--unrecorded.
The exit code is 0 if every value is within its bound.
"""

import argparse
import io
import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from importlib import import_module
from multiprocessing import get_context

from experiments import start_page
from figures import record
from figures.common import Absent, Figure, collected, console, modules
from figures.comparison import page
from figures.synthesis import SynthesisError
from moire.errors import MoireError
from twin import BuildError
from twin.build import SHORT_RUNS

PROCESSES = 2
LONG = (
    "linuxcnc",
    "s4",
    "full_clock",
    "s0",
    "twin_speed",
    "fine",
    "calibration",
    "s2s3",
    "bus",
    "profile",
)  # modules that take longest: first


@dataclass(frozen=True)
class Outcome:
    name: str
    value: float | None
    took: float
    error: str = ""
    facts: str = ""  # what the figure said beside its value, if it was not shown
    absent: bool = False  # what it needs is not installed


def measure(name: str, figure: Figure, quick: bool, seed: int | None) -> Outcome:
    """Whatever goes wrong is an outcome, too: one figure must not end a run of many."""
    began = time.perf_counter()
    try:
        value = figure.measured(quick, seed)
    except (MoireError, BuildError, SynthesisError) as error:
        took, absent = time.perf_counter() - began, isinstance(error, Absent)
        return Outcome(name, None, took, str(error) or repr(error), absent=absent)
    except Exception as error:
        console.print_exception()
        return Outcome(name, None, time.perf_counter() - began, repr(error))
    return Outcome(name, value, time.perf_counter() - began)


def measure_module(module: str, seed: int | None) -> list[Outcome]:
    """Short forms of all figures of a module, in a process of its own; what they print is kept."""
    outcomes = []
    # a module may have campaigns alone
    for name, figure in getattr(import_module(f"figures.{module}"), "FIGURES", {}).items():
        console.file = io.StringIO()
        done = measure(name, figure, True, seed)
        facts = console.file.getvalue()
        outcomes.append(replace(done, facts=facts))
    return outcomes


def in_parallel(seed: int | None) -> Iterator[Outcome]:
    """Short forms of all figures, module by module in two processes."""
    order = sorted(modules(), key=lambda name: LONG.index(name) if name in LONG else len(LONG))
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        jobs = [pool.submit(measure_module, module, seed) for module in order]
        for job in as_completed(jobs):
            yield from job.result()


def one_by_one(names: Sequence[str], quick: bool, seed: int | None) -> Iterator[Outcome]:
    figures = collected("FIGURES")
    for name in names:
        if len(names) > 1:
            console.rule(name)
        yield measure(name, figures[name], quick, seed)


def report(outcome: Outcome, figure: Figure, quick: bool) -> bool:
    """Prints the outcome: its meaning to standard error, the value to standard output. Returns
    whether it passes.
    """
    if outcome.absent:
        print(f"{outcome.name}: not measured: {outcome.error}", file=sys.stderr, flush=True)
        return False
    if outcome.value is None:
        console.print(outcome.facts, markup=False, highlight=False)
        print(f"{outcome.name}: {outcome.error}", file=sys.stderr, flush=True)
        return False
    bound = figure.quick.bound if quick and figure.quick.bound is not None else figure.bound_words
    passes = figure.passes(outcome.value, quick)
    if not passes:
        console.print(outcome.facts, markup=False, highlight=False)
    verdict = "[green]reached[/]" if passes else "[red]not reached[/]"
    judged = f"bound {bound}, {verdict}" if bound else "not judged"
    form = f"; short form: {figure.quick.words}" if quick else ""
    console.print(f"{figure.what}{form}: {judged}; measured in {outcome.took:.0f} s")
    unit = figure.quick.unit if quick and figure.quick.unit is not None else figure.unit
    print(f"{outcome.name} {outcome.value:.{figure.digits}f} {unit}", flush=True)
    return passes


def conclude(outcomes: Sequence[Outcome], names: Sequence[str], recorded: bool) -> None:
    """Writes the page of several figures, and the record of those that were measured in full."""
    figures = collected("FIGURES")
    if recorded:
        new = {
            done.name: record.entry_of(figures[done.name], done.value)
            for done in outcomes
            if done.value is not None
        }
        record.add(new, figures)
        console.print("recorded in docs/figures.toml; `make tables` puts it into README.md")
    if len(names) > 1:
        results = [
            (done.name, figures[done.name], done.value, done.error or done.took)
            for done in outcomes
        ]
        written = start_page.publish("figures", page(results))
        console.print(f"page: {written}", soft_wrap=True)


def main(arguments: Sequence[str] | None = None) -> int:
    figures = collected("FIGURES")
    parser = argparse.ArgumentParser(
        prog="python -m figures.figure", description="Measure figures on this machine."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a figure; see --list")
    parser.add_argument("--all", action="store_true", help="measure all, and write their page")
    parser.add_argument("--list", action="store_true", help="print which figures there are")
    parser.add_argument("--quick", action="store_true", help="the short forms, seconds each")
    parser.add_argument("--seed", type=int, help="of the random numbers, 1 and up (default 1)")
    parser.add_argument("--unrecorded", action="store_true", help="leave the record as it is")
    options = parser.parse_args(arguments)
    if options.list:
        for name, figure in figures.items():
            print(f"{name:24} {figure.what}; bound: {figure.bound_words}")
        return 0
    if unknown := [name for name in options.names if name not in figures]:
        parser.error(f"there is no figure {unknown[0]}: there are {', '.join(figures)}")
    names = list(figures) if options.all else options.names
    if not names:
        parser.error(f"which figure? There are {', '.join(figures)}")
    if options.seed is not None and options.seed < 1:
        parser.error("--seed takes 1 and up")
    if options.seed is not None and not options.all:
        if fixed := [name for name in names if not figures[name].seeded]:
            parser.error(f"{fixed[0]} draws no random numbers: it takes no seed")
    quick, seed = options.quick, options.seed
    if quick:
        os.environ[SHORT_RUNS] = "1"
    together = options.all and quick
    running = in_parallel(seed) if together else one_by_one(names, quick, seed)
    outcomes, passed = [], []
    for outcome in running:
        outcomes.append(outcome)
        passed.append(report(outcome, figures[outcome.name], quick))
    if not quick:
        conclude(outcomes, names, recorded=seed in (None, 1) and not options.unrecorded)
    failed = [one for one, passes in zip(outcomes, passed) if not passes]
    console.print(summary(len(outcomes), failed) if len(names) > 1 else "")
    return 1 if [one for one in failed if not (one.absent and options.all)] else 0


def summary(number: int, failed: Sequence[Outcome]) -> str:
    """The last line of several figures: how many pass, and the names of those that do not."""
    absent = [one.name for one in failed if one.absent]
    missed = [one.name for one in failed if not one.absent]
    parts = [f"{number - len(failed)} of {number} pass"]
    parts += [f"not measured: {', '.join(absent)}"] if absent else []
    parts += [f"failed: {', '.join(missed)}"] if missed else []
    return "; ".join(parts)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""What a figure is, and how the modules of this directory find and measure theirs.

A module that measures has a dictionary FIGURES = {name: Figure}; CAMPAIGNS = {name: Campaign} holds
its long tests (campaigns/campaign.py). Both are found by name: a new module needs no registration.
"""

import inspect
import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

from campaigns.campaign import seeds as seeds
from moire.errors import MoireError

HERE = Path(__file__).resolve().parent
TOOLS = {  # modules here that measure nothing
    "__init__",
    "browser",
    "common",
    "comparison",
    "figure",
    "record",
    "synthesis",
}
COMPARISONS = {"<=": operator.le, "<": operator.lt, ">=": operator.ge, ">": operator.gt}
PROCESSES = 2  # of long work in Python
Found = TypeVar("Found")
console = Console(stderr=True)  # facts and progress; the figure itself goes to standard output


class Absent(MoireError):
    """A program that only this figure needs is not installed. The figure is not measured, which is
    no failure of a run of all figures.
    """


def within(value: float, bound: str) -> bool:
    """Whether a value is within a bound: `<= 0.5`, `< 3`, `>= 4`, `> 5`, or the only good value."""
    found = re.fullmatch(r"(<=|<|>=|>)? ?(-?[\d.]+)", bound)
    if not found:
        raise ValueError(f"not a bound: {bound}")
    compare = COMPARISONS.get(found[1], operator.eq)
    return bool(compare(value, float(found[2])))


@dataclass(frozen=True)
class Quick:
    """The short form of a figure, a matter of seconds: `arguments` of its function that make it
    short, and what it leaves out, in words. Its bound is the figure's own if it is None; an empty
    one says that the number is not judged, since it means something else or is too uncertain.
    """

    arguments: Mapping[str, Any] = field(default_factory=dict)
    words: str = "the whole figure"
    bound: str | None = None
    unit: str | None = None  # where it is not the figure's


@dataclass(frozen=True)
class Figure:
    """One number, measured by a function that takes `seed` if it draws random numbers.

    `what` states what is measured and under which conditions: it is the row of README's table.
    `note` is what others have reached, beside the bound.
    """

    measure: Callable[..., float]
    unit: str
    what: str
    bound: str
    quick: Quick
    digits: int = 3
    note: str = ""

    @property
    def seeded(self) -> bool:
        return "seed" in inspect.signature(self.measure).parameters

    @property
    def bound_words(self) -> str:
        return f"{self.bound} ({self.note})" if self.note else self.bound

    def good(self, value: float) -> bool:
        return within(value, self.bound)

    def measured(self, quick: bool = False, seed: int | None = None) -> float:
        arguments = dict(self.quick.arguments) if quick else {}
        if seed is not None and self.seeded:
            arguments["seed"] = seed
        return float(self.measure(**arguments))

    def passes(self, value: float, quick: bool = False) -> bool:
        """Whether a measured value is a number, and within the bound of the form that was run."""
        bound = self.quick.bound if quick and self.quick.bound is not None else self.bound
        return math.isfinite(value) and (not bound or within(value, bound))


def shares(total: int, share: int, seed: int) -> Iterator[tuple[int, int]]:
    """(size, seed) of the runs into which a long run is divided."""
    sizes = [min(share, total - first) for first in range(0, total, share)]
    return zip(sizes, seeds(seed, len(sizes)), strict=True)


class Bar(Progress):
    """A progress bar. Where the output is no terminal, as in a log, each tenth of the work is a
    line instead, since the bar itself appears at the end only.
    """

    def __init__(self, text: str, output: Console = console):
        columns = TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        super().__init__(*columns, console=output)
        self.text, self.tenths = text, dict[TaskID, int]()

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        super().advance(task_id, advance)
        self.tell(task_id)

    def update(self, task_id: TaskID, **values: Any) -> None:
        super().update(task_id, **values)
        self.tell(task_id)

    def tell(self, task_id: TaskID) -> None:
        """Print a line if there is no terminal and a further tenth of the task is done."""
        task = next(task for task in self.tasks if task.id == task_id)
        if self.console.is_terminal or not task.total:
            return
        tenth = int(10 * task.completed / task.total)
        if self.tenths.get(task_id, 0) < tenth < 10:
            self.tenths[task_id] = tenth
            self.console.print(f"{self.text}: {10 * tenth} % after {task.elapsed or 0:.0f} s")


def bar(text: str) -> Bar:
    """A progress bar for long work."""
    return Bar(text)


def in_processes(
    text: str, run: Callable[..., Found], sizes: Sequence[int], *arguments: Iterable[Any]
) -> Iterator[Found]:
    """What `run` returns for each of the arguments, as with `map`, on PROCESSES processes and with
    a bar, which advances by one of the sizes each. The processes are spawned: a fork would inherit
    the bar's thread.
    """
    with bar(text) as progress, ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        task = progress.add_task("", total=sum(sizes))
        for size, found in zip(sizes, pool.map(run, *arguments), strict=True):
            progress.advance(task, size)
            yield found


def modules() -> list[str]:
    """Names of the modules that measure."""
    return sorted(path.stem for path in HERE.glob("*.py") if path.stem not in TOOLS)


def collected(attribute: str) -> dict[str, Any]:
    """The dictionaries of this name in all modules that measure, as one."""
    found: dict[str, Any] = {}
    for module in modules():
        found |= getattr(import_module(f"figures.{module}"), attribute, {})
    return found

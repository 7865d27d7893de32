# SPDX-License-Identifier: Apache-2.0
"""What every figure is made of."""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Callable

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

HERE = Path(__file__).parent
TOOLS = {
    "__init__",
    "common",
    "comparison",
    "figure",
    "soak",
    "synthesis",
}  # modules here that measure nothing

console = Console(stderr=True)  # facts and progress; the figure itself goes to standard output


@dataclass(frozen=True)
class Figure:
    measure: Callable[[], float]
    unit: str
    what: str
    wanted: str  # in words, with its comparison
    good: Callable[[float], bool]
    digits: int = 3


def bar(text):
    """A progress bar for long work."""
    return Progress(
        TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console
    )


def collected(attribute):
    """The dictionaries of this name in all modules that measure, as one."""
    found = {}
    for path in sorted(HERE.glob("*.py")):
        if path.stem not in TOOLS:
            found |= getattr(import_module(f"figures.{path.stem}"), attribute, {})
    return found

# SPDX-License-Identifier: Apache-2.0
"""Measure a named figure afresh on this machine; the last line printed is `name value unit`.

    python -m experiments.figure NAME         (make figure NAME=…)
    python -m experiments.figure --all        (make figures: all of them, and build/report/figures.html)
"""
import argparse
import html
import random
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from experiments import s0_stage

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "build" / "report" / "figures.html"
SEED = 1
console = Console(stderr=True)


@dataclass(frozen=True)
class Figure:
    measure: Callable[[], float]
    unit: str
    what: str
    wanted: str                      # in words, with its comparison
    good: Callable[[float], bool]
    digits: int = 3


def bar(text):
    return Progress(TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console)


def s0_coarse_um_max():
    """100 random moves of the homed stage, X and Y in turn, 0.1 um … 2 mm."""
    stage = s0_stage.Stage.power_up(SEED)
    stage.find()
    with bar("homing and 100 moves") as progress:
        task = progress.add_task("", total=100)
        for name in stage.axes:
            stage.home(name)
        moves = s0_stage.random_moves(stage, 100, SEED, done=lambda move: progress.advance(task))
    errors = np.array([move.error_nm for move in moves])
    times = np.array([move.time_s for move in moves])
    console.print(f"error of the true position: max {np.abs(errors).max():.1f} nm, rms {np.sqrt((errors**2).mean()):.1f} nm, "
                  f"mean {errors.mean():.1f} nm; "
                  f"time a move: median {np.median(times):.2f} s, longest {times.max():.2f} s")
    return np.abs(errors).max() / 1000


def s0_home_spread_nm():
    """20 homings of X from random places; the zero that each found, as a true place."""
    source, zeros = random.Random(SEED), []
    stage = s0_stage.Stage.power_up(SEED)
    stage.find()
    with bar("20 homings") as progress:
        task = progress.add_task("", total=20)
        for _ in range(20):
            status = stage.home("X")
            zeros.append(stage.true_nm("X", from_zero=False) - status.position_nm)
            progress.advance(task)
            stage.move("X", source.uniform(-0.5e6, 2e6))
    console.print(f"home phase of the last homing {stage.axes['X'].encoder().home_phase_nm:.0f} nm")
    return max(zeros) - min(zeros)

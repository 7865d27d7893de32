# SPDX-License-Identifier: Apache-2.0
"""Figure of the studies: how much faster is one on two workers."""

import tempfile
import time
from dataclasses import replace

from campaigns import runner
from campaigns.store import Store
from figures.common import Figure, Quick, console
from moire.errors import MoireError
from study import command
from study.machines import MACHINES

WORKERS = (1, 2)
RUNS, MOVES = 48, 10
TEXT = """\
machine = "s0"
[spec]
largest_error = "0.3 um"
[one_at_a_time]
repeats = 0
[fixed]
travel_start_lowest = "-0.95 mm"
travel_start_highest = "-0.9 mm"
[effects]
scale_linear = "typical to bad"
guide_tilt = "typical to bad"
scale_abbe_arm = "typical to bad"
floor_velocity = "typical to bad"
"""


def seconds_on(workers: int, runs: int, moves: int, seed: int, processes: bool) -> float:
    """Time of the study from the start of its workers to its last result, all runs done."""
    study = command.read(TEXT, "study", runs)
    study = replace(study, measure=replace(study.measure, moves=moves))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(folder)
        job = command.prepared(study, store, seed)
        began = time.perf_counter()
        with runner.local(workers, processes) as client:
            runner.run(client, {job.name: job}, store, runner.Watch())
            took = time.perf_counter() - began
    if len(job.results) != study.parts:
        raise MoireError(f"{study.parts - len(job.results)} runs of the study are not done")
    return took


def study_scaling(
    runs: int = RUNS, moves: int = MOVES, seed: int = 1, processes: bool = True
) -> float:
    MACHINES["s0"].prepare()
    one, two = (seconds_on(workers, runs, moves, seed, processes) for workers in WORKERS)
    console.print(f"{runs} runs: {one:.1f} s on one worker, {two:.1f} s on two")
    return one / two


FIGURES = {
    "study_scaling": Figure(
        study_scaling,
        "",
        f"time of moire study on one worker over two, on two cores with nothing else to do: {RUNS} "
        f"drawn machines of S0, {MOVES} moves each, the start of the workers included",
        ">= 1.8",
        Quick(
            {"runs": 1, "moves": 1, "processes": False},
            "one run of one move by one worker and one by two, threads instead of processes",
            "",
        ),
        2,
    ),
}

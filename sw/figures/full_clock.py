# SPDX-License-Identifier: Apache-2.0
"""Figure of the twin at the clock of the boards: what it measures there, beside the same at the
slow clocks of the other figures.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from experiments import full_clock
from experiments.full_clock import FAST_MM_S, FULL_CLK_HZ, SLOW_CLK_HZ, S0Result, S2Result
from figures.common import Figure, Quick, console

MOVES = 10
LEAST_MOVES = 3  # of one simulated second
THREADS = 2  # the simulation runs outside of Python's lock


def megahertz(clk_hz: float) -> str:
    return f"{clk_hz / 1e6:g} MHz"


def in_threads(jobs: Sequence[tuple[str, Callable[..., Any]]]) -> list[Any]:
    """The results of these jobs, two at a time. Each takes `progress` and reports how far it is."""
    with (
        Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[at]}"),
            console=console,
        ) as bars,
        ThreadPoolExecutor(THREADS) as pool,
    ):

        def run(words: str, job: Callable[..., Any]) -> Any:
            task = bars.add_task(words, total=1, at="power-up")

            def progress(seconds: float, what: str) -> None:
                bars.update(task, at=f"{seconds:.2f} s simulated, {what}")

            try:
                result = job(progress=progress)
            except Exception as error:
                bars.console.print(f"{words}: {error!r}")  # the other jobs may take minutes more
                raise
            bars.update(task, completed=1)
            bars.console.print(f"{words}: done")
            return result

        waiting = [pool.submit(run, words, job) for words, job in jobs]
        return [job.result() for job in waiting]


def show(title: str, clocks: Sequence[int], rows: Sequence[tuple[str, Sequence[str]]]) -> None:
    """Prints the results of the slow and of the full clock side by side."""
    table = Table("", *map(megahertz, clocks), title=title)
    for column in table.columns[1:]:
        column.justify = "right"
    for words, cells in rows:
        table.add_row(words, *cells)
    console.print(table)


def show_s0(results: Sequence[S0Result]) -> None:
    def row(words: str, cell: Callable[[S0Result], str]) -> tuple[str, list[str]]:
        return words, list(map(cell, results))

    show(
        f"S0: homing of X and Y, {len(results[0].errors_nm)} moves",
        [result.clk_hz for result in results],
        [
            row("servo ticks per second", lambda r: str(r.tick_hz)),
            row("samples per second", lambda r: f"{r.sample_hz:.0f}"),
            row("zero from a phase zero, nm", lambda r: f"{r.zero_nm:.1f}"),
            row("both homings, s", lambda r: f"{r.homing_s:.3f}"),
            row("largest |target - true position|, nm", lambda r: f"{r.largest_nm:.1f}"),
            row(
                "rms, nm",
                lambda r: f"{math.sqrt(sum(e * e for e in r.errors_nm) / len(r.errors_nm)):.1f}",
            ),
            row("mean duration of a move, s", lambda r: f"{sum(r.moves_s) / len(r.moves_s):.3f}"),
            row("repeated exchanges", lambda r: str(r.repeats)),
            row("simulated, s", lambda r: f"{r.simulated_s:.2f}"),
        ],
    )


def show_s2(results: Sequence[S2Result]) -> None:
    def row(words: str, cell: Callable[[S2Result], str]) -> tuple[str, list[str]]:
        return words, list(map(cell, results))

    def each(form: str, values: Sequence[float]) -> str:
        return ", ".join(format(value, form) for value in values)

    show(
        "S2: X, Y and Z at once, one second at the top speed",
        [result.clk_hz for result in results],
        [
            row("top speed, mm/s", lambda r: each("d", r.speeds_mm_s)),
            row("fastest counts per second", lambda r: f"{r.fastest():.0f}"),
            row("at the top speed, s", lambda r: each(".3f", r.at_top_s)),
            row("pulses of the scale", lambda r: each("d", r.pulses)),
            row("wrong counts", lambda r: each("d", r.wrong)),
            row("table minus node, counts", lambda r: each("+.2f", r.apart_counts)),
            row("lost steps", lambda r: str(r.lost_steps)),
            row("steps too short for the driver", lambda r: str(r.timing_errors)),
            row("simulated, s", lambda r: f"{r.simulated_s:.2f}"),
        ],
    )


def short_form(seed: int) -> float:
    """One second of one axis of S0, without homing to the switch; infinite for too few moves."""
    errors: list[float]
    (errors,) = in_threads([("S0, one axis", partial(full_clock.one_second, FULL_CLK_HZ, seed))])
    console.print(f"{len(errors)} moves within one simulated second")
    return max(map(abs, errors)) / 1000 if len(errors) >= LEAST_MOVES else math.inf


def full_clock_um(moves: int = MOVES, seed: int = 1) -> float:
    """Infinite if S2 counted a pulse wrongly or lost a step; 0 moves are the short form."""
    if not moves:
        return short_form(seed)
    jobs: list[tuple[str, Callable[..., Any]]] = []
    for clk_hz in (FULL_CLK_HZ, SLOW_CLK_HZ["s0"]):
        jobs.append((f"S0 at {megahertz(clk_hz)}", partial(full_clock.s0, clk_hz, moves, seed)))
    for clk_hz, speeds in sorted(FAST_MM_S.items(), reverse=True):
        jobs.append((f"S2 at {megahertz(clk_hz)}", partial(full_clock.s2, clk_hz, speeds, seed)))
    s0_full, s0_slow, s2_full, s2_slow = in_threads(jobs)
    show_s0((s0_slow, s0_full))
    show_s2((s2_slow, s2_full))
    failed = sum(s2_full.wrong) + s2_full.lost_steps + s2_full.timing_errors
    return math.inf if failed else s0_full.largest_nm / 1000


FIGURES = {
    "full_clock_um": Figure(
        full_clock_um,
        "um",
        f"CLK_HZ = {FULL_CLK_HZ / 1e6:g} MHz, 115200 baud: largest |target - true position| of "
        f"{MOVES} moves of S0 after homing, motor only; no wrong count of three axes of S2 at "
        "500, 500 and 400 mm/s for a second",
        "<= 0.05",
        Quick({"moves": 0}, "one simulated second of one axis of S0"),
        4,
    ),
}

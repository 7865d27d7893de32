# SPDX-License-Identifier: Apache-2.0
"""Figures of S0's fine stage: motor and piezo together."""

from functools import cache

import numpy as np

from experiments.s0_fine import HOLD_S, FineStage
from experiments.s0_stage import random_moves
from figures.common import Figure, bar, console

SEED = 1
MOVES = 100
POSITIONS_NM = (0.0, 250_100.0, 1_000_300.0)  # of the standstills: different phases


@cache
def prepared_stage():
    stage = FineStage.power_up(SEED)
    with bar("homing, learning") as progress:
        task = progress.add_task("", total=len(stage.axes))
        for name in stage.axes:
            stage.prepare(name)
            progress.advance(task)
    console.print(
        "zero beside a zero of the sine: "
        + ", ".join(
            f"{name} {stage.zero_nm[name] - stage.sine_zero_nm[name]:+.2f} nm"
            for name in stage.axes
        )
    )
    return stage


@cache
def errors_nm(count):
    """True position - target at the time when the node says that it has arrived."""
    stage = prepared_stage()
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        moves = random_moves(stage, count, SEED, done=lambda move: progress.advance(task))
    errors, times = (
        np.array([getattr(move, name) for move in moves]) for name in ("error_nm", "time_s")
    )
    console.print(
        f"true position - target: max {np.abs(errors).max():.2f} nm, rms {np.sqrt((errors**2).mean()):.2f} nm, "
        f"mean {errors.mean():+.2f} nm; a move takes {np.median(times):.2f} s (median), {times.max():.2f} s at most"
    )
    return errors


def s0_fine_nm_max(count=MOVES):
    return float(np.abs(errors_nm(count)).max())


def s0_fine_nm_rms(count=MOVES):
    return float(np.sqrt((errors_nm(count) ** 2).mean()))


def s0_hold_nm_rms():
    stage, found = prepared_stage(), []
    with bar("standstills") as progress:
        task = progress.add_task("", total=len(POSITIONS_NM) * len(stage.axes))
        for place in POSITIONS_NM:
            for name in stage.axes:
                stage.move(name, place)
                true = stage.watch(name, HOLD_S)["true_nm"] - place
                found.append(true.std())
                console.print(
                    f"{name} at {place / 1e6:.4f} mm: mean {true.mean():+.2f} nm, jitter {true.std():.2f} nm rms, "
                    f"{np.ptp(true):.2f} nm peak to peak"
                )
                progress.advance(task)
    return float(max(found))


FIGURES = {
    "s0_fine_nm_max": Figure(
        s0_fine_nm_max,
        "nm",
        "largest |true position - target| of 100 random moves (0.1 um to 2 mm), motor and piezo",
        "at most 5 (paper's aim 10)",
        lambda v: v <= 5,
        2,
    ),
    "s0_fine_nm_rms": Figure(
        s0_fine_nm_rms, "nm", "the same, rms", "at most 2", lambda v: v <= 2, 2
    ),
    "s0_hold_nm_rms": Figure(
        s0_hold_nm_rms,
        "nm",
        "true standstill jitter over 1 s, fine stage holding, worst of 3 places",
        "at most 1",
        lambda v: v <= 1,
        2,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of S0's fine stage: motor and piezo together."""

import random
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.s0_fine import HOLD_S, FineStage
from experiments.s0_stage import random_moves, random_target
from figures.common import Figure, Quick, bar, console

SEED = 1
MOVES = 100
POSITIONS_NM = (0.0, 250_100.0, 1_000_300.0)  # of the standstills: different phases


@cache
def prepared_stage(seed: int) -> FineStage:
    stage = FineStage.power_up(seed)
    with bar("homing, calibration") as progress:
        task = progress.add_task("", total=len(stage.axes))
        for name in stage.axes:
            stage.prepare(name)
            progress.advance(task)
    console.print(
        "zero of each axis less the nearest zero of its sine: "
        + ", ".join(
            f"{name} {stage.zero_nm[name] - stage.sine_zero_nm[name]:+.2f} nm"
            for name in stage.axes
        )
    )
    return stage


@cache
def errors_nm(count: int, seed: int) -> NDArray[np.float64]:
    """Target - true position at the time when the node reports that it has arrived."""
    stage = prepared_stage(seed)
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        moves = random_moves(stage, count, seed, done=lambda move: progress.advance(task))
    errors, times = (
        np.array([getattr(move, name) for move in moves]) for name in ("error_nm", "time_s")
    )
    console.print(
        f"target - true position: max {np.abs(errors).max():.2f} nm, "
        f"rms {np.sqrt((errors**2).mean()):.2f} nm, mean {errors.mean():+.2f} nm; "
        f"a move takes {np.median(times):.2f} s (median), {times.max():.2f} s at most"
    )
    return errors


def s0_fine_nm_max(count: int = MOVES, seed: int = SEED) -> float:
    return float(np.abs(errors_nm(count, seed)).max())


def s0_fine_nm_rms(count: int = MOVES, seed: int = SEED) -> float:
    return float(np.sqrt((errors_nm(count, seed) ** 2).mean()))


def jitter_nm_rms(stage: FineStage, positions: Sequence[float], hold_s: float) -> float:
    """The largest jitter of all axes and standstills."""
    found = []
    with bar("standstills") as progress:
        task = progress.add_task("", total=len(positions) * len(stage.axes))
        for position in positions:
            for name in stage.axes:
                stage.move(name, position)
                true = stage.watch(name, hold_s)["true_nm"] - position
                found.append(true.std())
                console.print(
                    f"{name} at {position / 1e6:.4f} mm: mean {true.mean():+.2f} nm, "
                    f"jitter {true.std():.2f} nm rms, {np.ptp(true):.2f} nm peak to peak"
                )
                progress.advance(task)
    return float(max(found))


def s0_hold_nm_rms(
    positions: Sequence[float] = POSITIONS_NM, hold_s: float = HOLD_S, seed: int = SEED
) -> float:
    return jitter_nm_rms(prepared_stage(seed), positions, hold_s)


# ------------------------------------------------------------------ signals that drift

DRIFT: dict[str, Any] = {
    "drift_offset": 0.02,
    "drift_gain": 0.02,
    "drift_phase": 1.0,
}  # see stage.toml
DRIFT_S = 600.0


def s0_fine_drift_nm_rms(drift_s: float = DRIFT_S, seed: int = SEED) -> float:
    """Moves until all has drifted; the calibration follows (`auto_calibration` 2)."""
    stage = FineStage.power_up(seed, **DRIFT, drift_time=drift_s)
    stage.prepare("X")
    stage.axes["X"].calibration("follow")
    source, here, errors = random.Random(seed), 0.0, []
    began = stage.bus.transport.now()
    with bar("moves while the signal drifts") as progress:
        task = progress.add_task("", total=drift_s - began)
        while stage.bus.transport.now() < drift_s:
            here = random_target(here, source)
            errors.append(stage.move("X", here).error_nm)
            progress.update(task, completed=stage.bus.transport.now() - began)
    state, found = stage.axes["X"].calibration(), np.array(errors)
    last = found[-max(1, len(found) // 10) :]
    console.print(
        f"{len(found)} moves in {drift_s - began:.0f} s: max {np.abs(found).max():.2f} nm, "
        f"mean {found.mean():+.2f} nm; rms of the last tenth {np.sqrt((last**2).mean()):.2f} nm; "
        f"{state.accepted - 1} ellipses followed, {state.refused} refused"
    )
    return float(np.sqrt((found**2).mean()))


FEW = Quick({"count": 3}, "three moves")


FIGURES = {
    "s0_fine_nm_max": Figure(
        s0_fine_nm_max,
        "nm",
        "largest |target - true position| of 100 random moves (0.1 um to 2 mm), motor and piezo, "
        "the X axis from its own zero; a perfect scale, no vibration, no drift",
        "<= 5",
        FEW,
        2,
        "the paper aims at 10",
    ),
    "s0_fine_nm_rms": Figure(s0_fine_nm_rms, "nm", "rms of the same", "<= 2", FEW, 2),
    "s0_hold_nm_rms": Figure(
        s0_hold_nm_rms,
        "nm",
        "true jitter at standstill over 1 s, fine stage holding, worst of 3 positions; noise of "
        "the ADC only",
        "<= 1",
        Quick({"positions": POSITIONS_NM[:1], "hold_s": 0.2}, "one position, 0.2 s"),
        2,
    ),
    "s0_fine_drift_nm_rms": Figure(
        s0_fine_drift_nm_rms,
        "nm",
        "rms of target - true position of random moves (0.1 um to 2 mm), motor and piezo, while "
        "+2 % of offset, +2 % of gain and +1 degree of phase drift in within ten minutes and the "
        "calibration follows; half of the phase drift cannot be told from motion",
        "<= 1.5",
        Quick({"drift_s": 10.0}, "10 s of drift", "<= 3"),
        2,
    ),
}

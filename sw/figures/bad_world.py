# SPDX-License-Identifier: Apache-2.0
"""Figures of S0 in a bad world: each effect of sw/twin/parameters/stage.toml has its bad value.

With the motor only, what drifts does so within the run instead of within ten minutes to half an
hour, which is harder.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from experiments.s0_fine import HOLD_S, FineStage
from experiments.s0_stage import ADDRESSES, Stage, random_moves
from figures.common import Figure, Quick, bar, console
from figures.fine import POSITIONS_NM, jitter_nm_rms
from moire.analysis.report import Move
from moire.analysis.tune import notch
from moire.client.axis import Axis
from moire.client.segments import Segments, SegmentTable
from moire.client.values import FILTER
from twin import WITH_SEGMENTS
from twin.parameters.tables import world

SEED = 1
LENGTH_NM = 500_000  # of a segment
SEGMENTS = 40  # 20 mm, as far as the random moves go
PLACES = 10  # from which they begin
READINGS = 4  # at a border
DRIFT_S = 60.0  # everything that drifts has drifted by then


def bad_stage(seed: int, axes: int = len(ADDRESSES), **plant: Any) -> Stage:
    """S0's axes, or the first of them, in a bad world; their nodes have a segment table and
    listen.
    """
    effects: dict[str, Any] = {
        **world("bad"),
        "drift_time": DRIFT_S,
        "temperature_time": DRIFT_S,
        **plant,
    }
    names = list(ADDRESSES)[:axes]
    return Stage.power_up(seed, names, node_parameters=WITH_SEGMENTS, **effects)


def reading_nm(stage: Stage, name: str, readings: int) -> float:
    """What an axis shows less where it truly is, the mean of some readings; from its zero."""
    return float(
        np.mean(
            [
                float(stage.axes[name].status().position_nm) - stage.true_nm(name)
                for _ in range(readings)
            ]
        )
    )


def measure_segments(
    stage: Stage, name: str, segments: int, readings: int = READINGS
) -> list[float]:
    """Measures the error of a scale at equal distances against the true position, as one does
    with a reference, and puts the table into force; returns the errors in nm.
    """
    errors = []
    for border in range(segments + 1):
        stage.move(name, border * LENGTH_NM)
        errors.append(reading_nm(stage, name, readings))
    stage.zero_nm[name] -= errors[0]  # the reference begins at the first border
    table = SegmentTable(
        Fraction(0), Fraction(LENGTH_NM), tuple(Fraction(error - errors[0]) for error in errors)
    )
    Segments(stage.axes[name]).load(table, "linear")
    return errors


def moves_within(stage: Stage, count: int, segments: int, seed: int) -> list[Move]:
    """So many random moves all over the segments, with their progress shown."""
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        return random_moves(
            stage,
            count,
            seed,
            done=lambda move: progress.advance(task),
            high_nm=float(segments * LENGTH_NM),
            places=min(PLACES, count),
        )


def s0_coarse_bad_um(
    count: int = 100, segments: int = SEGMENTS, axes: int = len(ADDRESSES), seed: int = SEED
) -> float:
    stage = bad_stage(seed, axes)
    before = {}
    with bar("homing and segments") as progress:
        task = progress.add_task("", total=len(stage.axes))
        for name in stage.axes:
            stage.home(name)
            before[name] = measure_segments(stage, name, segments)
            stage.move(name, 0.0)
            progress.advance(task)
    moves = moves_within(stage, count, segments, seed)
    errors = np.array([move.error_nm for move in moves])
    console.print(
        "error of the scales before: "
        + ", ".join(f"{name} {np.ptp(found):.0f} nm" for name, found in before.items())
        + f"; target - true position: max {np.abs(errors).max():.1f} nm, "
        f"rms {np.sqrt((errors**2).mean()):.1f} nm, mean {errors.mean():+.1f} nm; "
        f"{stage.bus.transport.now():.0f} s simulated"
    )
    return float(np.abs(errors).max() / 1000)


# ------------------------------------------------------------------ motor and piezo

FINE: dict[str, str | float] = {
    # an integral of 60 Hz, and a derivative that damps the mode of the flexure at 250 Hz; the
    # sensitivity is at most 2.3 for a mode from 225 to 275 Hz
    "fine_ki": 126_500 / 2**24,
    "fine_kp": 360 / 2**16,
    "fine_kd": 6540 / 2**16,
    "fine_reach": "100nm",
    "settle_window": "15nm",  # four times the rms of the floor's vibration at the table
    "settle_time": "100ms",
}
FINE_READINGS = 25  # at a border: the floor shakes them


def use_notch(axis: Axis, frequency_hz: float) -> None:
    """Gives the servo of the motor a notch at the mode of the flexure. The sensor sees how the
    table excites it, and without a notch the loop of a soft flexure is unstable.
    """
    coefficients = notch(frequency_hz, 1 / axis.node.identity.tick_hz)
    for name, value in zip(FILTER, coefficients, strict=True):
        axis.write_parameter(f"filter_1_{name}", value)
    axis.write_parameter("filters", 1)


@cache
def fine_stage(segments: int, calibrated: bool, seed: int) -> FineStage:
    """The X axis with its piezo in a bad world: homed, calibrated, its scale measured. What drifts
    does so within the times of stage.toml.
    """
    effects: dict[str, Any] = world("bad")
    stage = FineStage.power_up(seed, **effects)
    stage.fine = FINE
    use_notch(stage.axes["X"], effects["piezo_mode"])
    with bar("homing, calibration, segments") as progress:
        task = progress.add_task("", total=2)
        stage.prepare("X", calibrated)
        if calibrated:
            stage.axes["X"].calibration("follow")
        progress.advance(task)
        before = measure_segments(stage, "X", segments, FINE_READINGS)
        progress.advance(task)
    console.print(f"error of the scale before: {np.ptp(before):.0f} nm")
    return stage


def s0_fine_bad_nm_rms(
    count: int = 100, segments: int = SEGMENTS, calibrated: bool = True, seed: int = SEED
) -> float:
    stage = fine_stage(segments, calibrated, seed)
    stage.move("X", 0.0)
    moves = moves_within(stage, count, segments, seed)
    errors, times = (
        np.array([getattr(move, name) for move in moves]) for name in ("error_nm", "time_s")
    )
    console.print(
        f"target - true position: max {np.abs(errors).max():.2f} nm, mean {errors.mean():+.2f} nm; "
        f"a move takes {np.median(times):.2f} s (median), {times.max():.2f} s at most; "
        f"{stage.bus.transport.now():.0f} s simulated"
    )
    return float(np.sqrt((errors**2).mean()))


def s0_hold_bad_nm_rms(
    positions: Sequence[float] = POSITIONS_NM,
    hold_s: float = HOLD_S,
    segments: int = SEGMENTS,
    calibrated: bool = True,
    seed: int = SEED,
) -> float:
    return jitter_nm_rms(fine_stage(segments, calibrated, seed), positions, hold_s)


FIGURES = {
    "s0_coarse_bad_um": Figure(
        s0_coarse_bad_um,
        "um",
        "S0 with the bad value of every effect of stage.toml (scale, guides, temperature, drift, "
        "floor VC-C, motor, converters), the scale measured every 0.5 mm: largest "
        "|target - true position| of 100 random moves (0.1 um to 2 mm, from ten "
        "places all over 20 mm), motor only",
        "<= 0.3",
        Quick(
            {"count": 2, "segments": 3, "axes": 1},
            "one axis, two moves within 1.5 mm, three segments",
        ),
        4,
    ),
    "s0_fine_bad_nm_rms": Figure(
        s0_fine_bad_nm_rms,
        "nm",
        "S0 with the bad value of every effect of stage.toml, its scale measured every 0.5 mm and "
        "its calibration following: rms of target - true position of 100 random moves (0.1 um to "
        "2 mm, from ten places all over 20 mm), motor and piezo with a notch at its mode, from a "
        "zero that was measured in the same way; the signals drift within 10 minutes, the "
        "temperature with a time constant of half an hour",
        "<= 10",
        Quick(
            {"count": 2, "segments": 1, "calibrated": False},
            "two moves within 0.5 mm, one segment, sine and cosine not calibrated",
            "<= 20",
        ),
        2,
    ),
    "s0_hold_bad_nm_rms": Figure(
        s0_hold_bad_nm_rms,
        "nm",
        "the same stage: true jitter at standstill over 1 s, fine stage holding, worst of 3 "
        "positions, on a floor VC-C, with a flexure of 250 Hz and Q 50",
        "<= 5",
        Quick(
            {"positions": POSITIONS_NM[:1], "hold_s": 0.2, "segments": 1, "calibrated": False},
            "one position, 0.2 s, sine and cosine not calibrated",
        ),
        2,
    ),
}

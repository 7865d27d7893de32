# SPDX-License-Identifier: Apache-2.0
"""Figures of S0 in a bad world: each effect of sw/twin/parameters/stage.toml has its bad value.

What drifts does so within the run instead of within ten minutes to half an hour, which is harder.
"""

from fractions import Fraction
from typing import Any

import numpy as np

from experiments.s0_stage import ADDRESSES, Stage, random_moves
from figures.common import Figure, Quick, bar, console
from moire.client.segments import Segments, SegmentTable
from twin import WITH_SEGMENTS
from twin.parameters.tables import world

SEED = 1
LENGTH_NM = 500_000  # of a segment
SEGMENTS = 40  # 20 mm, as far as the random moves go
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


def reading_nm(stage: Stage, name: str) -> float:
    """What an axis shows less where it truly is, the mean of some readings; from its zero."""
    return float(
        np.mean(
            [
                float(stage.axes[name].status().position_nm) - stage.true_nm(name)
                for _ in range(READINGS)
            ]
        )
    )


def measure_segments(stage: Stage, name: str, segments: int) -> list[float]:
    """Measures the error of a scale at equal distances against the true position, as one does
    with a reference, and puts the table into force; returns the errors in nm.
    """
    errors = []
    for border in range(segments + 1):
        stage.move(name, border * LENGTH_NM)
        errors.append(reading_nm(stage, name))
    stage.zero_nm[name] -= errors[0]  # the reference begins at the first border
    table = SegmentTable(
        Fraction(0), Fraction(LENGTH_NM), tuple(Fraction(error - errors[0]) for error in errors)
    )
    Segments(stage.axes[name]).load(table, "linear")
    return errors


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
    with bar("moves") as progress:
        task = progress.add_task("", total=count)
        moves = random_moves(
            stage,
            count,
            seed,
            done=lambda move: progress.advance(task),
            high_nm=float(segments * LENGTH_NM),
        )
    errors = np.array([move.error_nm for move in moves])
    console.print(
        "error of the scales before: "
        + ", ".join(f"{name} {np.ptp(found):.0f} nm" for name, found in before.items())
        + f"; true position - target: max {np.abs(errors).max():.1f} nm, "
        f"rms {np.sqrt((errors**2).mean()):.1f} nm, mean {errors.mean():+.1f} nm; "
        f"{stage.bus.transport.now():.0f} s simulated"
    )
    return float(np.abs(errors).max() / 1000)


FIGURES = {
    "s0_coarse_bad_um": Figure(
        s0_coarse_bad_um,
        "um",
        "S0 with the bad value of every effect of stage.toml (scale, guides, temperature, drift, "
        "floor VC-C, motor, converters), the scale measured every 0.5 mm: largest "
        "|true position - target| of 100 random moves (0.1 um to 2 mm, within 20 mm), motor only",
        "<= 0.3",
        Quick(
            {"count": 2, "segments": 3, "axes": 1},
            "one axis, two moves within 1.5 mm, three segments",
        ),
        4,
    ),
}

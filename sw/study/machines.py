# SPDX-License-Identifier: Apache-2.0
"""The machines that a study can take, and what one run of them does."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

from experiments.s0_stage import Stage, random_moves
from figures.bad_world import LENGTH_NM, measure_segments
from twin import WITH_SEGMENTS, Twin
from twin.parameters import tables

AXIS = "X"  # the axes of the stage are equal: a study measures one of them


@dataclass(frozen=True)
class Measure:
    """What a run does after homing; lengths in nm."""

    moves: int = 10
    travel_nm: float = 10e6
    shortest_move_nm: float = 100.0
    longest_move_nm: float = 2e6
    calibrated: bool = False
    scale_corrected: bool = False

    @property
    def segments(self) -> int:
        """Number of segments that the travel has in the segment table."""
        return ceil(self.travel_nm / LENGTH_NM) if self.scale_corrected else 0


@dataclass(frozen=True)
class Measured:
    """The errors of the moves of a run in nm, and the simulated time that it took."""

    errors_nm: Sequence[float]
    simulated_s: float


@dataclass(frozen=True)
class Machine:
    """A machine of a study.

    `table` names its parameters in sw/twin/parameters, `absent` how those of its absent parts
    begin. `run(values, measure, seed, targets)` is one run: parameters, what is measured, the
    seed of the machine, that of the targets. `prepare` builds what all runs need. `expected_s`
    estimates the processor time of a run.
    """

    name: str
    what: str
    table: str
    travel_nm: float
    run: Callable[[Mapping[str, float], Measure, int, int], Measured]
    prepare: Callable[[], object]
    expected_s: Callable[[Measure], float]
    absent: tuple[str, ...] = ()

    @cached_property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """{name: entry} of the table, without the parts that are absent."""
        entries: dict[str, dict[str, Any]] = tables.load(self.table)
        return {name: e for name, e in entries.items() if not name.startswith(self.absent)}

    @cached_property
    def effects(self) -> list[str]:
        """The parameters that have a bad value."""
        return [name for name in tables.world("bad", self.table) if name in self.parameters]


# ------------------------------------------------------------------ S0


def run_s0(values: Mapping[str, float], measure: Measure, seed: int, targets: int) -> Measured:
    """Powers up an axis of S0's stage with these parameters, homes it and makes the moves. The
    error is the target minus the true position, the zero being that of the homing.
    """
    plant: dict[str, Any] = dict(values)
    stage = Stage.power_up(seed, [AXIS], node_parameters=WITH_SEGMENTS, **plant)
    with stage.twin:
        stage.home(AXIS)
        if measure.calibrated:
            stage.calibrate_ellipse(AXIS)
            stage.home(AXIS)
        if measure.scale_corrected:
            measure_segments(stage, AXIS, measure.segments)
            stage.move(AXIS, 0.0)
        moves = random_moves(
            stage,
            measure.moves,
            targets,
            high_nm=measure.travel_nm,
            lengths_nm=(measure.shortest_move_nm, measure.longest_move_nm),
            places=measure.moves,
        )
        return Measured([move.error_nm for move in moves], stage.bus.transport.now())


def build_s0() -> None:
    """The library of the twin and the firmware."""
    Twin(nodes=(1,), node_parameters=WITH_SEGMENTS).close()


# Processor time of the parts of a run, from runs on a core of 2 GHz; only for an estimate.
HOME_S, MOVE_S, WAY_S_MM, CALIBRATE_S, SEGMENT_S = 2.5, 0.4, 0.5, 11.0, 0.5


def expected_s0(measure: Measure) -> float:
    calibrate = (CALIBRATE_S + HOME_S) * measure.calibrated
    way_mm = measure.travel_nm / 1e6 / 3  # to another place of the travel, on average
    moves = (MOVE_S + WAY_S_MM * way_mm) * measure.moves
    return HOME_S + moves + calibrate + SEGMENT_S * measure.segments


MACHINES = {
    machine.name: machine
    for machine in (
        Machine(
            "s0",
            "one axis of the X-Y stage with a grating interferometer, positioned by its motor",
            "stage",
            100e6,
            run_s0,
            build_s0,
            expected_s0,
            absent=("piezo_",),
        ),
    )
}

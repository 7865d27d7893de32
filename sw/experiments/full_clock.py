# SPDX-License-Identifier: Apache-2.0
"""S0 and S2 at the clock of the boards, 60 MHz, and at the slow clocks of the other experiments.

The baud rate and the servo tick are those of the firmware: 115200 baud, 4000 ticks a second at any
clock. The rate of the ADCs and the fastest count depend on the clock.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from experiments import s0_stage, s2_stage
from experiments.s2_stage import Scale
from moire.analysis import report
from moire.client.bus import Bus
from twin import Twin, TwinTransport
from twin.nodes.twin import CLK_HZ as S0_CLK_HZ

FULL_CLK_HZ = 60_000_000
SLOW_CLK_HZ = {"s0": S0_CLK_HZ, "s2": s2_stage.CLK_HZ}
TOP_S = 1.0  # for which S2 moves at its top speed
ACCELERATION, JERK = 2.0, 50.0  # of S2, in m/s2 and m/s3
AT_TOP = 0.98  # of the top speed: the rotor of a stepper vibrates by less than the difference
TRACE_HZ = 1000
START_M = 5e-3  # position of the tables of S2 at power-up
SHORT_MOVES_NM = (40e3, 10e3, 60e3, 20e3)  # targets of the short form, in turn

Progress = Callable[[float, str], object]  # simulated seconds; what happens


def quiet(_: float, __: str) -> None:
    """Progress that nobody watches."""


# ------------------------------------------------------------------ S0


@dataclass(frozen=True)
class S0Result:
    """Both nodes of S0: homing, and moves of X and Y in turn."""

    clk_hz: int
    tick_hz: int
    sample_hz: int
    zero_nm: float  # largest distance of a zero from a phase zero of the interferometer
    homing_s: float  # of both axes, one after the other
    errors_nm: tuple[float, ...]  # target - true position of each move
    moves_s: tuple[float, ...]  # duration of each move
    repeats: int  # of exchanges on the bus, after the search for nodes
    simulated_s: float

    @property
    def largest_nm(self) -> float:
        """The largest error of a move."""
        return max(map(abs, self.errors_nm))


def from_phase_zero_nm(stage: s0_stage.Stage, name: str) -> float:
    """The distance of the zero of an axis from the nearest phase zero of the interferometer. The
    true position is the mean of before and after the answer of the node.
    """
    period, before = s0_stage.PERIOD_NM, stage.true_nm(name, from_zero=False)
    answer = float(stage.axes[name].status().position_nm)
    true = (before + stage.true_nm(name, from_zero=False)) / 2
    return (true - answer + period / 2) % period - period / 2


def s0(clk_hz: int, moves: int, seed: int = 1, progress: Progress = quiet) -> S0Result:
    """Homes the stage of S0 and moves it."""
    stage = s0_stage.Stage.power_up(seed, clk_hz=clk_hz)
    now, made, zeros = stage.bus.transport.now, list[report.Move](), list[float]()
    identity, began = stage.find()[0], now()
    searching = stage.bus.statistics.repeats  # one for each address that nobody has
    for name in stage.axes:
        stage.home(name, lambda _: progress(now(), "homing"))
        zeros.append(from_phase_zero_nm(stage, name))
    homing_s = now() - began
    s0_stage.random_moves(
        stage, moves, seed, lambda _: progress(now(), f"move {len(made) + 1}"), made.append
    )
    return S0Result(
        clk_hz,
        identity.tick_hz,
        identity.sample_hz,
        max(map(abs, zeros)),
        homing_s,
        tuple(move.error_nm for move in made),
        tuple(move.time_s for move in made),
        stage.bus.statistics.repeats - searching,
        now(),
    )


def one_second(
    clk_hz: int = FULL_CLK_HZ, seed: int = 1, seconds: float = 1.0, progress: Progress = quiet
) -> list[float]:
    """The X axis of S0 from power-up on: it takes its present position as its zero and makes short
    moves until `seconds` have been simulated. Returns the true distance of each move minus the
    distance by the node, in nm.
    """
    with Twin(nodes=(1,), seed=seed, clk_hz=clk_hz) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed), poll_s=s0_stage.POLL_S)
        twin.run_until_ready()
        axis, errors = bus.axis(1), list[float]()
        axis.enable()
        axis.home(method=35)
        while bus.transport.now() < seconds:
            before = twin.true_position_nm(), float(axis.status().position_nm)
            axis.move(
                nm=SHORT_MOVES_NM[len(errors) % len(SHORT_MOVES_NM)],
                progress=lambda _: progress(bus.transport.now(), f"move {len(errors) + 1}"),
            )
            after = twin.true_position_nm(), float(axis.status().position_nm)
            errors.append(after[0] - before[0] - (after[1] - before[1]))
        return errors


# ------------------------------------------------------------------ S2


@dataclass(frozen=True)
class S2Result:
    """One move of all three axes of S2. The tuples have one value of each axis."""

    clk_hz: int
    speeds_mm_s: tuple[int, ...]  # top speeds of the moves
    at_top_s: tuple[float, ...]  # for which the table was that fast
    pulses: tuple[int, ...]  # of the scale
    wrong: tuple[int, ...]  # pulses that were not counted, or counted twice
    apart_counts: tuple[float, ...]  # distance of the table by the model minus distance by the node
    lost_steps: int
    timing_errors: int  # steps that were too short for the driver
    simulated_s: float

    def fastest(self) -> float:
        """Counts per second of the fastest axis."""
        return max(
            speed * 1000 / float(scale.count_um)
            for speed, scale in zip(self.speeds_mm_s, fast_scales(self.speeds_mm_s).values())
        )


def way_mm(speed_mm_s: float) -> float:
    """The distance of a move that is TOP_S long at its top speed."""
    speed = speed_mm_s / 1000
    return speed_mm_s * (TOP_S + speed / ACCELERATION + ACCELERATION / JERK)


def fast_scales(speeds_mm_s: tuple[int, ...]) -> dict[str, Scale]:
    """The scales of S2 with these top speeds, on longer and steeper screws: 5 mm screws would turn
    100 times a second.
    """
    return {
        name: replace(
            scale,
            travel_mm=round(way_mm(speed)) + 20,
            step_um=Fraction(5, 2),
            top_mm_s=speed,
            lead_mm=20,
        )
        for (name, scale), speed in zip(s2_stage.SCALES.items(), speeds_mm_s)
    }


def s2(
    clk_hz: int, speeds_mm_s: tuple[int, ...], seed: int = 1, progress: Progress = quiet
) -> S2Result:
    """Moves all axes of S2 at once; each is TOP_S long at its top speed."""
    scales = fast_scales(speeds_mm_s)
    stage = s2_stage.Stage.power_up(seed, clk_hz, scales)
    now = stage.bus.transport.now
    stage.polled = lambda: progress(now(), "move")
    for name, axis in stage.axes.items():
        progress(now(), f"setting up {name}")
        stage.twin.set_position(stage.number(name), START_M)
        for parameter, value in (
            ("acceleration", f"{ACCELERATION}m/s2"),
            ("jerk", f"{JERK}m/s3"),
            ("following_limit", "2mm"),
            ("ki", 0),  # the steps of the motor are coarser than the dead band can be
            ("settle_window", "20um"),
            ("home_method", 35),
            ("home_offset", 0),
            ("travel_low", "-2mm"),
            ("travel_high", f"{scales[name].travel_mm}mm"),
        ):
            axis.set_parameter(parameter, value)
        axis.enable()
        axis.home()
        stage.twin.trace(stage.number(name), TRACE_HZ)
    made = stage.move(
        "fast", {name: way_mm(scale.top_mm_s) * 1e3 for name, scale in scales.items()}
    )
    numbers = range(len(made))
    traces = [stage.twin.take_trace(number)["velocity_m_s"] for number in numbers]
    truths = [stage.twin.truth(number) for number in numbers]
    return S2Result(
        clk_hz,
        speeds_mm_s,
        tuple(
            float((trace > AT_TOP * speed / 1000).sum()) / TRACE_HZ
            for trace, speed in zip(traces, speeds_mm_s)
        ),
        tuple(abs(move.given) for move in made),
        tuple(move.wrong for move in made),
        tuple(move.apart_um / float(scales[move.axis].count_um) for move in made),
        sum(abs(truth.lost_steps) for truth in truths),
        sum(truth.step_timing_errors for truth in truths),
        now(),
    )


FAST_MM_S: Mapping[int, tuple[int, ...]] = {  # of X, Y and Z
    # one million counts per second: the node counts at most one in each cycle
    SLOW_CLK_HZ["s2"]: (500, 500, 100),
    # 1, 1 and 4 million: a node moves an axis by at most one million periods per second, which are
    # 400 mm/s of the scale of Z
    FULL_CLK_HZ: (500, 500, 400),
}

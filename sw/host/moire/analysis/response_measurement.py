# SPDX-License-Identifier: Apache-2.0
"""Measure the frequency response of an axis with a multisine on the commands of its servo.

response = measure(axis)                         # the axis moves slowly and evenly meanwhile
plant = fit(response)                            # measured_plant.py: a plant of tune.py
Path("response.png").write_bytes(picture(response, plant, tuning))
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from fractions import Fraction

import numpy

from moire import units
from moire.analysis.frequency_response import (
    LOWEST_HZ,
    PEAK,
    PERIOD,
    Excitation,
    Response,
    check,
    computed,
    joined,
    multisine,
)
from moire.analysis.tick_scope import TickScope, Trigger
from moire.analysis.tune import FULL_SCALE, SATURATED, NotTuned, Tuning
from moire.client.access import COUNTS
from moire.client.axis import Axis
from moire.client.calibration import ends_of_stroke

LOW_LINES = 40  # of that of the low frequencies
SPLIT_HZ = 20.0  # below this the multisine has its full period, above it a quarter
PERIODS = 2  # of a record
RECORDS = 2
SPEED_PERIODS = 0.625  # signal periods of the scale in a tick: away from all that is measured
SIGNALS = ("error", "command")
AT_SPEED = 0.99  # of the speed: the axis moves evenly
SPARE = 1.02  # of the stroke
APPROACH = 0.1  # of the stroke, below it, from where the motions of the slower loop come
LEAST_SENSITIVITY = 0.1  # share of the excitation that the loop must leave
SOFT_BANDWIDTH = 6.0  # of the slower loop, in lowest frequencies
MOST_OF_THE_SPEED = 0.3  # that the excitation of the slower loop may take
SETTLING_PERIODS = 1  # of the multisine, until its response is periodic


def in_force(axis: Axis) -> Tuning:
    """The gains and filters that an axis has; their margins are not known yet."""
    return made(*axis.tuning())


def made(gains: Mapping[str, int], filters: Sequence[Sequence[int]]) -> Tuning:
    """Gains and filters in counts, whose margins are not known yet."""
    return Tuning(
        **gains,
        filters=tuple((b0, b1, b2, a1, a2) for b0, b1, b2, a1, a2 in filters),
        bandwidth_hz=0.0,
        phase_margin_degree=0.0,
        gain_margin=0.0,
    )


def speed_nm_s(axis: Axis) -> float:
    """A speed at which the errors of sine and cosine disturb no frequency that is measured.

    They repeat with each signal period; at this speed their frequency, its double and what the
    sampling makes of them are above a quarter of the tick rate.
    """
    return SPEED_PERIODS * float(axis.period_nm) * axis.node.identity.tick_hz


def measure(
    axis: Axis,
    peak: units.Value = PEAK,
    speed: units.Number | None = None,
    records: int = RECORDS,
    low_hz: float = LOWEST_HZ,
    high_hz: float | None = None,
    progress: Callable[[int, int], object] = lambda done, records: None,
) -> Response:
    """The response of an axis, which must be enabled, homed and at rest, by some records.

    Meanwhile the axis moves to and fro at `speed` (nm/s; None: speed_nm_s(); 0: it stays), so that
    friction does not change its sign, on the side of its position where its travel has room.
    Frequencies above SPLIT_HZ are measured first. The loop suppresses what is lower than its
    bandwidth: the frequencies below SPLIT_HZ, and those of which it leaves less than
    LEAST_SENSITIVITY, are measured with smaller gains.
    The node times each record: its motion, the excitation and the recording begin there, at ticks,
    so the measurement does not depend on how fast host and connection are.
    `peak` is the largest value of the multisine, a share of full scale; `progress` gets the number
    of records done and their number. At the end the axis has its own gains and override again, and
    stands where it was. Raises NotTuned, NotRecorded, OutOfRange, Refused or MotionFailed.
    """
    tick_s = 1 / axis.node.identity.tick_hz
    high = multisine(tick_s, max(low_hz, SPLIT_HZ), high_hz, peak, PERIOD // 4)
    wished = speed_nm_s(axis) if speed is None else float(speed)
    tuning = in_force(axis)
    check_room(axis, high, wished, records)
    begin_nm = far_nm = Fraction(axis.status().target_nm)
    if wished:
        begin_nm, far_nm = ends_of_stroke(axis, stroke(axis, PERIOD, wished, APPROACH))
    motion = Motion(wished, begin_nm, far_nm >= begin_nm)
    done = 0

    def one_more() -> None:
        nonlocal done
        done += 1
        progress(done, 2 * records)

    def work() -> Response:
        response = recorded(axis, high, motion, records, one_more)
        low = low_band(response, high, low_hz, wished / float(axis.period_nm) * COUNTS)
        if low is None:
            return response
        factor = softness(response, low_hz)
        soft = lambda: softened(axis, tuning, factor)
        return joined(recorded(axis, low, motion, records, one_more, soft), response, tuning)

    response = axis.stopping_on_error(work)
    if wished:
        axis.move(nm=begin_nm)
    return check(response)


def check_room(axis: Axis, excitation: Excitation, speed_nm_s: float, records: int) -> None:
    """Raises NotTuned unless axis and node can do this, and the command has room for the peak."""
    scope, length = TickScope(axis), len(excitation.values)
    if speed_nm_s and not axis.status().homed:
        raise NotTuned(
            "the axis has no zero yet, so its travel is not known: home it first, or measure with "
            "--speed 0mm/s or --method steps"
        )
    if scope.longest(SIGNALS) < PERIODS * length:
        raise NotTuned(
            f"{PERIODS} periods of {length} ticks do not fit into the recorder of the node: it has "
            f"{scope.words()} words; ask for a shorter period"
        )
    if records < 1:
        raise NotTuned(f"{records} records are too few: at least 1")
    limit = axis.get_parameter("output_limit").counts
    largest = int(numpy.abs(excitation.values).max())
    if largest > limit // 2:
        raise NotTuned(
            f"a peak of {100 * largest / FULL_SCALE:.0f} % is more than half of the output_limit, "
            f"{100 * limit / FULL_SCALE:.0f} %: the command would be at its limit; use a smaller "
            "peak"
        )


@dataclass(frozen=True)
class Motion:
    """How an axis moves while it is measured."""

    speed_nm_s: float  # 0: not at all
    begin_nm: Fraction  # where it stands at the beginning, and at the end
    up: bool  # it moves above that place, else below it

    def ends_nm(self, stroke_nm: Fraction | int) -> list[Fraction]:
        """The lowest and the highest position of a motion of this length."""
        far_nm = self.begin_nm + (stroke_nm if self.up else -stroke_nm)
        return sorted([self.begin_nm, far_nm])


def recorded(
    axis: Axis,
    excitation: Excitation,
    motion: Motion,
    records: int,
    progress: Callable[[], object],
    soft: Callable[[], AbstractContextManager[None]] | None = None,
) -> Response:
    """The response by some records, each with a motion of its own.

    With `soft`, which makes the gains smaller, all motions go up, and the axis comes to their
    beginning from below with its own gains: then friction has its sign already, and makes no error.
    """
    scope, length = TickScope(axis), len(excitation.values)
    every = excitation.sparse
    scope.load(excitation.values)
    speed_nm_s, approach = motion.speed_nm_s, 0.0 if soft is None else APPROACH
    ends_nm = motion.ends_nm(stroke(axis, length, speed_nm_s, approach) if speed_nm_s else 0)
    errors, commands = [], []
    for number in range(records):
        trigger = Trigger(delay=SETTLING_PERIODS * length + 1)
        begin_nm, end_nm = ends_nm if soft is not None or number % 2 == 0 else ends_nm[::-1]
        if speed_nm_s:
            trigger = at_speed(axis, speed_nm_s, trigger.delay)
            axis.move(nm=begin_nm)
            if soft is not None:
                axis.move(nm=begin_nm + (end_nm - begin_nm) * Fraction(approach / (1 + approach)))
        with nullcontext() if soft is None else soft(), scope.excited(length):
            scope.start(
                SIGNALS, PERIODS * length // every, every * Fraction(excitation.tick_s), trigger
            )
            if speed_nm_s:
                with slowed(axis, speed_nm_s):
                    axis.begin_move(nm=end_nm)
                    scope.wait()
            values = scope.read().values
        status = axis.status()
        if status.faults:
            axis.reached(status)
        errors.append(values["error"])
        commands.append(values["command"])
        progress()
    limit = axis.get_parameter("output_limit").counts
    if float(numpy.mean(numpy.abs(commands) >= limit)) > SATURATED:
        raise NotTuned("the command was at its limit: use a smaller peak, or a slower motion")
    return computed(excitation, errors, commands, float(axis.period_nm), every)


def top_speed_nm_s(axis: Axis) -> float:
    """The speed of a motion at full override."""
    return axis.get_parameter("velocity").counts * float(axis.period_nm)


def stroke(axis: Axis, period: int, speed_nm_s: float, approach: float) -> Fraction:
    """The length in nm of the motion of a record with this period in ticks, and before it the
    approach, a share of it.

    It begins and ends as at full override, but slower.
    """
    velocity, acceleration, jerk = (
        axis.get_parameter(name).counts for name in ("velocity", "acceleration", "jerk")
    )
    ramps_nm = top_speed_nm_s(axis) * (velocity / acceleration + acceleration / jerk)
    lasts_s = (SETTLING_PERIODS + PERIODS) * period / axis.node.identity.tick_hz
    return Fraction(SPARE * (1 + approach) * (speed_nm_s * lasts_s + ramps_nm))


@contextmanager
def slowed(axis: Axis, speed_nm_s: float) -> Iterator[None]:
    """The axis with an override for this speed, as long as the block lasts; then it stops."""
    override = axis.override()
    axis.override(min(1.0, speed_nm_s / top_speed_nm_s(axis)))
    try:
        yield
    finally:
        axis.stop_if_enabled()
        axis.override(override)


def at_speed(axis: Axis, speed_nm_s: float, delay: int) -> Trigger:
    """So many ticks after the target of a motion has reached its speed, up or down."""
    nm_s = AT_SPEED * min(speed_nm_s, top_speed_nm_s(axis))
    return Trigger("beyond", "target_velocity", f"{nm_s * 1e-6:.9g}mm/s", delay=delay)


# low frequencies, which the loop suppresses


def crossover_hz(response: Response) -> float:
    """The lowest measured frequency at which the open loop is below 1; the highest one if none."""
    below = numpy.flatnonzero(numpy.abs(response.open_loop) < 1)
    return float(response.hz[below[0] if below.size else -1])


def softness(response: Response, low_hz: float) -> float:
    """The factor of the gains with which the loop lets this frequency through."""
    return min(1.0, SOFT_BANDWIDTH * low_hz / crossover_hz(response))


def low_band(
    response: Response, high: Excitation, low_hz: float, speed_lsb_s: float
) -> Excitation | None:
    """A multisine of the low frequencies that are not measured yet; None if there are none.

    Its peak does not stop a motion.
    """
    slow = response.hz[numpy.abs(response.sensitivity) < LEAST_SENSITIVITY]
    top_hz = max([SPLIT_HZ, *(slow * 1.02)])
    if low_hz >= top_hz:
        return None
    at = max(0, min(len(slow), len(response.hz) - 1))
    velocity = float(numpy.abs(response.plant[at]) * 2 * math.pi * response.hz[at])
    peak = float(numpy.abs(high.values).max())
    if speed_lsb_s:
        peak = min(peak, MOST_OF_THE_SPEED * speed_lsb_s / velocity)
    return multisine(high.tick_s, low_hz, top_hz, peak / FULL_SCALE, PERIOD, LOW_LINES)


@contextmanager
def softened(axis: Axis, tuning: Tuning, factor: float) -> Iterator[None]:
    """The axis with gains that make its loop slower by this factor, as long as the block lasts."""
    factors = {"kp": factor, "ki": factor**2, "kd": factor}
    try:
        for name, part in factors.items():
            axis.write_parameter(name, round(getattr(tuning, name) * part))
        yield
    finally:
        axis.stop_if_enabled()  # gains do not change during a motion
        for name in factors:
            axis.write_parameter(name, getattr(tuning, name))

# SPDX-License-Identifier: Apache-2.0
"""The motion that calibrates sine and cosine: strokes over a distance at several speeds."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from moire import units
from moire.client.records import CalibrationState, Status
from moire.client.values import ParameterValue
from moire.errors import BusError, MoireError, NotCalibrated, OutOfRange

if TYPE_CHECKING:
    from moire.client.axis import Axis

# fractions of the top speed: the calibration needs several speeds
SPEEDS = (Fraction(1), Fraction(3, 5), Fraction(4, 5))
SAMPLES = 20  # in one period at the top speed; the calibration needs eight
STROKE_S = 0.5  # for one stroke at the top speed: most of it is then at a constant speed


def calibrate(
    axis: Axis,
    progress: Callable[[CalibrationState], object] | None,
    distance: units.Value,
    timeout: units.Value,
    check: Callable[[], object] | None = None,
) -> CalibrationState:
    """See Axis.calibrate(). `check` is called when a stroke has begun; what it raises, after it has
    stopped the axis, ends the calibration.
    """
    stroke, patience = units.parse_length(distance), units.parse_time(timeout)
    if stroke <= 0 or patience <= 0:
        raise OutOfRange("distance and timeout of the calibration must be above zero")
    start, far = ends_of_stroke(axis, stroke)
    velocity = axis.get_parameter("velocity")
    fastest = min(
        Fraction(velocity.counts),
        Fraction(axis.node.identity.sample_hz // SAMPLES),
        stroke / axis.period_nm / Fraction(STROKE_S),
    )
    axis.calibration()  # raises Refused if the axis is not built for it
    end, strokes = axis.transport.now() + float(patience), 0
    begun = False  # the first stroke is accepted: from then on there is a new correction
    reason = "standstill"  # the latest one in motion: at the end of a stroke the axis is at rest

    def follow(status: Status) -> None:
        nonlocal reason
        if status.state == "moving" and (now := axis.calibration().reason) != "standstill":
            reason = now

    def next_stroke() -> None:
        nonlocal begun
        axis.begin_move(nm=start if strokes % 2 else far)
        if not begun:
            begun = True
            axis.calibration("clear")
            axis.calibration("calibrate")
        if check is not None:
            check()
        axis.wait(follow)

    try:
        while True:
            speed = fastest * SPEEDS[strokes // 2 % len(SPEEDS)]
            axis.write_parameter("velocity", max(1, round(speed)))
            carry_out(axis, next_stroke)
            strokes += 1
            state = replace(axis.calibration(), reason=reason)
            if progress is not None:
                progress(state)
            if state.settled and strokes % 2 == 0:
                return axis.calibration("freeze")
            if axis.transport.now() > end:
                raise NotCalibrated(
                    state.reason,
                    f"axis {axis.number} of node {axis.node.address} found no correction within "
                    f"{units.format_time(patience)}: {state.words} ({state.accepted} accepted, "
                    f"{state.refused} refused)",
                )
    finally:
        end_calibration(axis, velocity, begun)


def ends_of_stroke(axis: Axis, stroke: Fraction) -> tuple[Fraction, Fraction]:
    """The present target, and the far end on the side where the travel has room, both in nm."""
    low, high = (axis.get_parameter(name).value for name in ("travel_low", "travel_high"))
    start = Fraction(axis.status().target_nm)
    far = start + stroke if start + stroke <= high else start - stroke
    if far < low:
        raise OutOfRange(
            f"there is no room for {units.format_length(stroke)}: the travel is "
            f"{units.format_length(low)} to {units.format_length(high)}"
        )
    return start, far


def carry_out(axis: Axis, stroke: Callable[[], None]) -> None:
    """Carries out a stroke. Whatever interrupts it stops the axis under control, but a stroke that
    is refused, or ended by somebody else, stops nothing: another client may move the axis then.
    """
    try:
        axis.stopping_on_error(stroke)
    except BusError:
        axis.stop_if_enabled()
        raise


def end_calibration(axis: Axis, velocity: ParameterValue, begun: bool = True) -> None:
    """Restores the velocity and, if a stroke was begun, freezes the correction, as far as that is
    possible. It does not stop the axis.

    An error here is dropped, since the one that ended the calibration explains more.
    """
    if begun:
        with suppress(MoireError):
            axis.calibration("freeze")
    with suppress(MoireError):
        axis.write_parameter("velocity", velocity.counts)

# SPDX-License-Identifier: Apache-2.0
"""Calibrations of sine and cosine for the clients of the doors: the server carries one out, and
clients ask how far it is. What was corrected before is kept for a comparison.
"""

import asyncio
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from http import HTTPStatus
from typing import Any

from moire.bus.arbiter import Place
from moire.client.axis import HARMONICS, Axis
from moire.client.calibration import calibrate, end_calibration
from moire.client.names import CAUSE_CODES, refusal
from moire.client.records import CalibrationState, Correction
from moire.client.values import ParameterValue
from moire.errors import MoireError
from moire.web.bridge import Bridge, Client, was_stopped
from moire.web.refusals import BadRequest

HARMONIC_LSB = 2.0**-24  # of a period
ORDERS = range(1, HARMONICS + 1)


@dataclass
class Run:
    """One calibration. `before` has the harmonics that were corrected at its beginning, in nm."""

    client: Client
    before: list[float] = field(default_factory=list)
    velocity: ParameterValue | None = None  # of the axis, which has other ones meanwhile
    state: str = "running"
    words: str = "the calibration begins"
    strokes: int = 0
    latest: CalibrationState | None = None
    task: "asyncio.Task[None] | None" = None

    def progress(self, state: CalibrationState) -> None:
        """A stroke has ended."""
        self.strokes, self.latest, self.words = self.strokes + 1, state, state.words


def harmonics_nm(axis: Axis) -> list[float]:
    """The amplitude of each harmonic of the phase error that is corrected, by order, in nm."""
    return amplitudes_nm(axis.correction(), float(axis.period_nm))


def amplitudes_nm(correction: Correction, period_nm: float) -> list[float]:
    """The amplitudes of the harmonics of a correction, in nm."""
    terms = zip(correction["cosine"], correction["sine"], strict=True)
    return [math.hypot(*both) * HARMONIC_LSB * period_nm for both in terms]


async def begin(bridge: Bridge, client: Client, place: Place, given: Mapping[str, Any]) -> Run:
    """Begins a calibration; raises BadRequest while another one is under way."""
    found = bridge.calibrations.get(place)
    if found is not None and found.state == "running":
        raise BadRequest(
            "calibrates_already",
            f"axis {place[0]}.{place[1]} is being calibrated by {found.client}",
            "wait until it has ended, or stop the axis",
            HTTPStatus.CONFLICT,
        )

    run = Run(client)

    def prepare(axis: Axis) -> None:
        run.before, run.velocity = harmonics_nm(axis), axis.get_parameter("velocity")
        status = axis.status()
        if status.in_motion:
            raise refusal(place[0], "calibration", CAUSE_CODES["busy"])
        if not status.enabled:
            axis.enable_for("move")

    bridge.calibrations[place] = run  # the next one who asks sees it at once
    try:
        await bridge.command(client, place, prepare)
    except BaseException:
        del bridge.calibrations[place]
        if found is not None:
            bridge.calibrations[place] = found
        raise
    distance, timeout = given.get("distance", "1mm"), given.get("timeout", "120s")
    run.task = asyncio.create_task(carry_out(bridge, run, place, distance, timeout))
    return run


async def carry_out(bridge: Bridge, run: Run, place: Place, distance: str, timeout: Any) -> None:
    """Carries a calibration out. A stop ends it, also one between two strokes: it is ahead of the
    next stroke in the queue. If its client leaves meanwhile, the server ends it properly.
    """
    stops = bridge.gateway.stops[place]

    def check(axis: Axis) -> None:
        if bridge.gateway.stops[place] != stops:
            axis.stop_and_wait()
            raise was_stopped()

    try:
        run.latest = await bridge.command(
            run.client,
            place,
            lambda axis: calibrate(axis, run.progress, distance, timeout, partial(check, axis)),
            "calibration",
        )
        run.state, run.words = "done", "the correction is complete and frozen"
    except MoireError as error:
        words = str(error)
        if run.client.left:
            words = "its client has left"
            await tidy_up(bridge, run, place)
        run.state, run.words = "ended", words


async def tidy_up(bridge: Bridge, run: Run, place: Place) -> None:
    """Ends what a client has left: the arbiter stops the axis, whose velocity is then restored."""
    velocity = run.velocity
    assert velocity is not None  # since the calibration was begun
    with suppress(MoireError):
        await bridge.end_of_motion(place, lambda status: status.in_motion)
        await bridge.command(bridge, place, lambda axis: end_calibration(axis, velocity))


async def values_of(bridge: Bridge, client: Client, place: Place) -> dict[str, Any]:
    """How far the calibration of an axis is, and what is corrected now."""
    run = bridge.calibrations.get(place)
    now = await bridge.command(client, place, harmonics_nm)
    latest = run.latest if run else None
    return {
        "state": run.state if run else "none",
        "words": run.words if run else "this server has not calibrated the axis",
        "strokes": run.strokes if run else 0,
        "accepted": latest.accepted if latest else 0,
        "refused": latest.refused if latest else 0,
        "scatter_nm": latest.scatter_nm if latest else None,
        "orders": list(ORDERS),
        "before_nm": run.before if run else [],
        "now_nm": now,
    }

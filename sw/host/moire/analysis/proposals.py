# SPDX-License-Identifier: Apache-2.0
"""Proposals for the servo of an axis whose plant was measured: what each would give, and a picture.

    plant = measured_plant.fit(response)
    found = proposals.of(plant, current, margin_degree=50)
    Path("tuning.png").write_bytes(proposals.picture(plant, found))

The first proposal is what the axis has. The feed-forward of the others is the inverse of the plant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy
from numpy.typing import NDArray

from moire.analysis import report
from moire.analysis.frequency_response import Response
from moire.analysis.measured_plant import MeasuredPlant
from moire.analysis.tune import (
    Filter,
    NotTuned,
    Plant,
    Tuning,
    notch,
    open_loop,
    propose,
    stable,
    step,
    with_margins,
)
from moire.client.access import COUNTS, FULL_SCALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:
    Axes = object

Array = NDArray[numpy.float64]

IN_FORCE = "in force"
GAINS = "gains alone"
NOTCHED = "gains and notch"
LEAST_GAIN_MARGIN = 2.0  # of what is proposed: 6 dB
TRIED = 48  # bandwidths, evenly spaced on a logarithmic axis
SETTLED = 0.05  # of a step
STEP_S = 4.0  # duration of a simulated step, in 1/bandwidth


@dataclass(frozen=True)
class Proposal:
    """Gains and filters, and what they give with a plant."""

    name: str
    tuning: Tuning  # with its bandwidth and margins
    stable: bool
    sensitivity: float  # the largest |1 / (1 + open loop)|: how much the worst disturbance grows
    overshoot: float  # of a step, as a share of it
    settling_s: float  # until a step stays within SETTLED

    @property
    def gain_margin_db(self) -> float:
        """The gain margin in dB."""
        return float(20 * numpy.log10(self.tuning.gain_margin))


def judged(plant: Plant, name: str, tuning: Tuning) -> Proposal:
    """What gains and filters give."""
    found = with_margins(plant, tuning)
    hz = numpy.geomspace(1e-4, 0.499, 4000) / plant.tick_s
    sensitivity = float(numpy.abs(1 / (1 + open_loop(plant, found, hz))).max())
    target, position = response_to_step(plant, found)
    away = numpy.flatnonzero(numpy.abs(position / target - 1) > SETTLED)
    return Proposal(
        name,
        found,
        stable(plant, found),
        sensitivity,
        max(0.0, float(position.max() / target[0] - 1)),
        float(away[-1] + 1 if away.size else 0) * plant.tick_s,
    )


def response_to_step(
    plant: Plant, tuning: Tuning, time_s: float | None = None
) -> tuple[Array, Array]:
    """Target and position at each tick after a step, as moire.analysis.tune.step() has them."""
    bandwidth_hz = max(tuning.bandwidth_hz, 0.01 / plant.tick_s)
    duration_s = STEP_S / bandwidth_hz if time_s is None else time_s
    return step(plant, tuning, max(60, round(duration_s / plant.tick_s)))


def fastest(plant: Plant, margin_degree: float, filters: Sequence[Filter]) -> Tuning:
    """The gains with the largest bandwidth that keeps the margins; raises NotTuned without any."""
    for bandwidth_hz in numpy.geomspace(0.12 / plant.tick_s, 1.0, TRIED).tolist():
        try:
            tuning = propose(plant, bandwidth_hz, margin_degree, filters)
        except NotTuned:
            continue
        if tuning.gain_margin >= LEAST_GAIN_MARGIN:
            return tuning
    raise NotTuned(
        f"no gains give a phase margin of {margin_degree:g} degrees and a gain margin of "
        f"{LEAST_GAIN_MARGIN:g} at any bandwidth from 1 Hz on: ask for a smaller phase margin"
    )


def of(
    plant: Plant,
    current: Tuning,
    margin_degree: float = 50.0,
    bandwidth_hz: float | None = None,
    has_filters: bool = True,
) -> list[Proposal]:
    """What the axis has, and what it could have instead; raises NotTuned if nothing keeps the
    margins.

    Without a bandwidth each is as fast as the margins allow. A notch is proposed where the plant
    has a resonance and the axis filters.
    """
    found = [judged(plant, IN_FORCE, current)]
    wished: list[tuple[str, tuple[Filter, ...]]] = [(GAINS, ())]
    if has_filters and plant.resonance_hz is not None:
        wished.append((NOTCHED, (notch(plant.resonance_hz, plant.tick_s),)))
    refusals = []
    for name, filters in wished:
        try:
            if bandwidth_hz is None:
                tuning = fastest(plant, margin_degree, filters)
            else:
                tuning = propose(plant, bandwidth_hz, margin_degree, filters)
        except NotTuned as refusal:
            refusals.append(refusal)
            continue
        found.append(judged(plant, name, tuning))
    if len(found) == 1:
        raise refusals[-1]
    return found


def best(found: Sequence[Proposal]) -> Proposal:
    """The fastest of the proposals; of equally fast ones, that with the smallest sensitivity."""
    return max(found[1:], key=lambda one: (round(one.tuning.bandwidth_hz, 1), -one.sensitivity))


def picture(plant: Plant, found: Sequence[Proposal]) -> bytes:
    """The open loops and the steps, and above them the plant with its points and its model if its
    frequency response was measured, as PNG.
    """
    response = plant.measured if isinstance(plant, MeasuredPlant) else None
    measured = 3 if response else 0
    figure, panels = report.drawing(
        width=8.0,
        height=11.0 if response else 6.5,
        nrows=measured + 2,
        gridspec_kw={"height_ratios": [3, 2, 1, 3, 3][-measured - 2 :]},
    )
    lowest_hz = response.hz[0] if response else 1e-3 / plant.tick_s
    if response:
        draw_response(panels[:measured], plant, response)
    loop, steps = panels[measured:]
    hz = numpy.geomspace(lowest_hz, 0.49 / plant.tick_s, 900)
    slowest = min(max(one.tuning.bandwidth_hz, 1.0) for one in found)
    for number, one in enumerate(found):
        colour = report.colour(number + 1) if number else "#777777"
        gain = 20 * numpy.log10(numpy.abs(open_loop(plant, one.tuning, hz)))
        loop.semilogx(hz, gain, color=colour, label=f"open loop: {one.name}")
        loop.axvline(one.tuning.bandwidth_hz, color=colour, linewidth=0.8, linestyle="--")
        if one.stable:
            target, position = response_to_step(plant, one.tuning, STEP_S / slowest)
            time_ms = numpy.arange(len(target)) * plant.tick_s * 1e3
            steps.plot(time_ms, position / target, color=colour, label=f"step: {one.name}")
    loop.axhline(0, color="#555555", linewidth=0.8)
    loop.set_ylim(-60, 60)
    loop.set_ylabel("open loop / dB")
    loop.set_xlabel("frequency / Hz")
    steps.axhline(1, color="#555555", linewidth=0.8, linestyle="--")
    steps.set_ylabel("step")
    steps.set_xlabel("time / ms")
    for panel in panels[: measured + 1]:
        panel.set_xlim(lowest_hz, 0.5 / plant.tick_s)
    for panel in (loop, steps):
        panel.legend(frameon=False, fontsize="small")
    return report.png(figure)


def draw_response(panels: Sequence[Axes], plant: Plant, response: Response) -> None:
    """Size and phase of the plant, measured and of its model, and the coherence."""
    size, phase, coherence = panels
    hz = numpy.geomspace(response.hz[0], 0.49 / plant.tick_s, 900)
    nm = response.period_nm / COUNTS * FULL_SCALE
    model = Plant.response(plant, hz)
    size.loglog(hz, numpy.abs(model) * nm, color=report.colour(1), label="plant: model")
    size.loglog(
        response.hz,
        numpy.abs(response.plant) * nm,
        "o",
        markersize=3,
        color=report.colour(0),
        label="plant: measured",
    )
    size.set_ylabel("nm at full scale")
    turned = numpy.degrees(numpy.unwrap(numpy.angle(response.plant)))
    phase.semilogx(response.hz, turned, "o", markersize=3, color=report.colour(0))
    at = numpy.degrees(numpy.unwrap(numpy.angle(model)))
    phase.semilogx(hz, at + 360 * round((turned[0] - at[0]) / 360), color=report.colour(1))
    phase.set_ylabel("phase / degree")
    phase.set_ylim(turned.min() - 60, turned.max() + 60)
    coherence.semilogx(response.hz, response.coherence, color=report.colour(2))
    coherence.set_ylim(0, 1.05)
    coherence.set_ylabel("coherence")
    size.legend(frameon=False, fontsize="small")

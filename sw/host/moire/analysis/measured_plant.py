# SPDX-License-Identifier: Apache-2.0
"""The plant of an axis as a model that is fitted to its measured frequency response."""

import math
from dataclasses import dataclass

import numpy
from numpy.typing import ArrayLike

from moire.analysis.frequency_response import Array, Complex, Response, check
from moire.analysis.least_squares import least_squares
from moire.analysis.tune import UNEXPLAINED, NotTuned, Plant, check_direction

CLEAR_ERROR = 0.02  # relative standard error of a point that counts half in a fit
MODE_GAIN = 0.5  # a mode is one if it leaves less than this share of the squares


@dataclass(frozen=True)
class MeasuredPlant(Plant):
    """A fitted plant whose response is what was measured, where it was measured clearly."""

    measured: Response | None = None

    def response(self, hz: ArrayLike) -> Complex:
        """Position over command: the model, times what was measured beyond it."""
        model = super().response(hz)
        if self.measured is None:
            return model
        clear = self.measured.clear
        at = self.measured.hz[clear]
        beyond = numpy.log(self.measured.plant[clear] / super().response(at))
        where = numpy.log(numpy.maximum(numpy.asarray(hz, float), 1e-9))
        size = numpy.interp(where, numpy.log(at), beyond.real)
        turn = numpy.interp(where, numpy.log(at), numpy.unwrap(beyond.imag))
        inside = (where >= math.log(at[0])) & (where <= math.log(at[-1]))
        return numpy.asarray(model * numpy.exp(numpy.where(inside, size + 1j * turn, 0)), complex)


def modelled(values: Array, tick_s: float, has_mode: bool) -> Plant:
    """The plant of the parameters of a fit: the logarithms of its time constant in ticks, gain,
    ticks of delay, second time constant in ticks, and of frequency and damping of the mode.
    """
    time, gain, late, second = (float(value) for value in numpy.exp(values[:4]))
    a = math.exp(-1 / max(time, 0.05))
    whole = int(late)
    mode = (float(math.exp(values[4])), float(math.exp(values[5]))) if has_mode else (None, None)
    return Plant(
        a=a,
        b=gain * (1 - a),
        delay=whole,
        tick_s=tick_s,
        resonance_hz=mode[0],
        part=late - whole,
        damping=mode[1],
        lag=math.exp(-1 / max(second, 0.05)),
    )


def fit(response: Response) -> MeasuredPlant:
    """The plant that responds as it was measured; raises NotTuned where no model does."""
    check(response)
    clear = response.clear
    hz, points = response.hz[clear], response.plant[clear]
    weight = 1 / (1 + response.error[clear] / CLEAR_ERROR)
    check_direction(-float(points[:3].imag.mean()))  # the position follows the velocity

    def misfit(values: Array, has_mode: bool) -> Array:
        with numpy.errstate(all="ignore"):
            ratio = numpy.log(modelled(values, response.tick_s, has_mode).response(hz) / points)
        turn = (ratio.imag + math.pi) % (2 * math.pi) - math.pi
        parts = numpy.concatenate([ratio.real * weight, turn * weight])
        return numpy.asarray(numpy.nan_to_num(parts, nan=1e3, posinf=1e3, neginf=-1e3), float)

    def best(starts: list[list[float]], has_mode: bool) -> tuple[Array, Array]:
        fits = [least_squares(lambda v: misfit(v, has_mode), numpy.log(start)) for start in starts]
        return min(fits, key=lambda fitted: float(fitted[1] @ fitted[1]))

    w = 2 * math.pi * hz * response.tick_s
    rigid = [
        [time, float(numpy.median(numpy.abs(points) * w * numpy.hypot(1, w * time))), late, 0.5]
        for time in (4.0, 40.0, 400.0)
        for late in (0.5, 1.5, 3.5)
    ]
    values, left = best(rigid, False)
    beyond = numpy.abs(points / modelled(values, response.tick_s, False).response(hz))
    upper = hz > hz[0] * 10
    peak_hz = float(hz[upper][beyond[upper].argmax()]) if upper.any() else float(hz[-1])
    time, gain, late, _ = numpy.exp(values)
    with_mode, left_with_mode = best(
        [
            [time, gain, max(0.3, late - second), second, peak_hz, damping]
            for second in (0.1, 1.0)
            for damping in (0.01, 0.05, 0.2)
        ],
        True,
    )
    has_mode = bool(left_with_mode @ left_with_mode < MODE_GAIN * (left @ left))
    if has_mode:
        values, left = with_mode, left_with_mode
    found = modelled(values, response.tick_s, has_mode)
    left_out = numpy.abs(found.response(hz) / points - 1) ** 2 * weight
    unexplained = float(numpy.sqrt(left_out.sum() / weight.sum()))
    if unexplained > UNEXPLAINED:
        raise NotTuned(
            f"{100 * unexplained:.0f} % of the response are not that of a motor with one "
            "resonance: measure again with a larger peak, and look at the points in the picture"
        )
    return MeasuredPlant(**{**vars(found), "unexplained": unexplained, "measured": response})

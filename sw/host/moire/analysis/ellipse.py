# SPDX-License-Identifier: Apache-2.0
"""The ellipse through samples of sine and cosine, and what is to be done about their amplitude.

    found = fit(cosines, sines)
    print(found.amplitude, judged(found, 100, Limits(32, 160, 126)).words)

The model is cosine = cos_offset + cos_amplitude cos(phase), and sine = sin_offset + sin_amplitude
sin(phase + quadrature error).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy

from moire.errors import MoireError
from moire.made.bus_tables import PARAMETERS

FEWEST = 12  # samples of an ellipse
WIDEST_GAP_DEG = 90  # of the phase, in which there may be no sample
OFF = PARAMETERS["signal_clip_level"].max  # with this value there is no limit


class NoEllipse(MoireError):
    """The samples do not determine an ellipse."""


@dataclass(frozen=True)
class Ellipse:
    """An ellipse; lengths in ADC counts."""

    cos_offset: float
    sin_offset: float
    cos_amplitude: float
    sin_amplitude: float
    quadrature_error_deg: float  # by how much sine and cosine are more than 90 degrees apart
    deviation: float  # rms of the samples from the ellipse, along the radius

    @property
    def amplitude(self) -> float:
        """The mean of both amplitudes."""
        return (self.cos_amplitude + self.sin_amplitude) / 2

    def points(self, count: int = 96) -> tuple[list[float], list[float]]:
        """Cosines and sines of a closed curve with so many points."""
        turns = [math.tau * n / (count - 1) for n in range(count)]
        error = math.radians(self.quadrature_error_deg)
        return (
            [self.cos_offset + self.cos_amplitude * math.cos(turn) for turn in turns],
            [self.sin_offset + self.sin_amplitude * math.sin(turn + error) for turn in turns],
        )


@dataclass(frozen=True)
class Limits:
    """The limits of an axis, in ADC counts: its parameters amplitude_low, amplitude_high and
    signal_clip_level.
    """

    low: int
    high: int
    clip: int


@dataclass(frozen=True)
class Judged:
    """The amplitude in words, and what to do; `to_do` is empty if nothing is."""

    kind: str  # good, weak, large, saturated, unknown
    words: str
    to_do: str


def fit(cos: Sequence[float], sin: Sequence[float]) -> Ellipse:
    """The ellipse with the least squares of the conic equation; raises NoEllipse."""
    if len(cos) < FEWEST:
        raise NoEllipse(
            f"too few different samples: {len(cos)} of at least {FEWEST}; does the axis move?"
        )
    both = numpy.array([cos, sin], dtype=float)
    middle = (both.max(axis=1) + both.min(axis=1)) / 2
    reach = float(abs(both - middle[:, None]).max()) or 1.0
    x, y = (both - middle[:, None]) / reach
    gap = widest_gap_deg(x, y)
    if gap > WIDEST_GAP_DEG:
        raise NoEllipse(
            f"the samples leave {gap:.0f} degrees of the circle empty: move the axis by some "
            "signal periods during the measurement"
        )
    terms = numpy.column_stack([x * x, x * y, y * y, x, y])
    (a, b, c, d, e), _, rank, _ = numpy.linalg.lstsq(terms, numpy.ones(len(x)), rcond=None)
    if rank < terms.shape[1] or 4 * a * c <= b * b or a <= 0:
        raise NoEllipse("the samples lie on no ellipse: check both channels of the encoder")
    x0, y0 = numpy.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e])
    size = 1 + a * x0 * x0 + b * x0 * y0 + c * y0 * y0
    sine = -b / (2 * math.sqrt(a * c))  # of the quadrature error
    widths = [math.sqrt(size / (term * (1 - sine * sine))) for term in (a, c)]
    value = a * (x - x0) ** 2 + b * (x - x0) * (y - y0) + c * (y - y0) ** 2
    radial = numpy.hypot(x - x0, y - y0) * (1 - 1 / numpy.sqrt(value / size))
    return Ellipse(
        float(middle[0] + reach * x0),
        float(middle[1] + reach * y0),
        float(reach * widths[0]),
        float(reach * widths[1]),
        math.degrees(math.asin(sine)),
        float(reach * math.sqrt(float(numpy.mean(radial**2)))),
    )


def widest_gap_deg(x: Sequence[float], y: Sequence[float]) -> float:
    """The widest angle around the origin without a point."""
    angles = numpy.sort(numpy.degrees(numpy.arctan2(y, x)))
    return float(numpy.diff(angles, append=angles[0] + 360).max())


def judged(ellipse: Ellipse, largest_code: float, limits: Limits | None) -> Judged:
    """The amplitude of an ellipse, with the largest code of its samples."""
    smaller = min(ellipse.cos_amplitude, ellipse.sin_amplitude)
    larger = max(ellipse.cos_amplitude, ellipse.sin_amplitude)
    size = f"The amplitude is {ellipse.amplitude:.1f} ADC counts"
    if limits is None:
        return Judged(
            "unknown", f"{size}; this axis has no signal monitor that would have limits for it", ""
        )
    if limits.clip != OFF and largest_code > limits.clip:
        return Judged(
            "saturated",
            f"{size}, and the ADC saturates: codes up to {largest_code:.0f} were seen, good are up "
            f"to {limits.clip}",
            "lower the gain of the amplifier or the light of the head, or remove the offset, until "
            f"all codes are within {limits.clip}",
        )
    if smaller < limits.low:
        return Judged(
            "weak",
            f"{size}, and too weak: the smaller channel has {smaller:.1f}, good are {limits.low} "
            f"to {limits.high}",
            "clean scale and head, check the gap and the alignment of the head and its supply; "
            "then raise the gain of the amplifier",
        )
    if larger > limits.high:
        return Judged(
            "large",
            f"{size}, and too large: the larger channel has {larger:.1f}, good are {limits.low} "
            f"to {limits.high}",
            "lower the gain of the amplifier or the light of the head",
        )
    words = f"{size}, which is good: the limits are {limits.low} to {limits.high}"
    return Judged("good", words, "")

# SPDX-License-Identifier: Apache-2.0
"""What a metrologist asks of a positioning axis: power spectral density, cumulative rms and Allan
deviation at standstill, accuracy and repeatability by ISO 230-2, circles by ISO 230-4, settling
times, harmonics.

    still = density(error_nm, rate_hz=4000)
    print(still.amplitude, "nm/sqrt(Hz)", still.cumulative_rms[-1], "nm rms")
    tau_s, deviation_nm = allan_deviation(error_nm, rate_hz=4000)
    test = Positioning(target_nm, up=errors_up_nm, down=errors_down_nm)
    print(test.accuracy, test.repeatability)
    circle = Circle(radius_mm, counterclockwise=points_mm, clockwise=others_mm)
    print(circle.deviation, circle.hysteresis)

Values and errors may have any unit of length or angle, and results have the same unit. An error is
target minus position, as everywhere in this project. `moire.analysis.metrology_pictures` draws the
results.
"""

from dataclasses import dataclass

import numpy
from numpy.typing import ArrayLike, NDArray

from moire.errors import MoireError

Array = NDArray[numpy.float64]

FEWEST = 16  # values of a spectral density or of an Allan deviation
SEGMENTS = 8  # of a spectral density; they overlap by half


class NotMeasured(MoireError):
    """There are too few values, or values that do not belong together."""


# ------------------------------------------------------------------ standstill


@dataclass(frozen=True)
class Density:
    """A one-sided power spectral density, without the mean of the values. Arrays by frequency, from
    one bin above 0 to half the rate.
    """

    frequency_hz: Array
    power: Array  # unit squared per Hz

    @property
    def amplitude(self) -> Array:
        """The square root of the density, in the unit per sqrt(Hz)."""
        return numpy.asarray(numpy.sqrt(self.power))

    @property
    def cumulative_rms(self) -> Array:
        """The rms of all that happens up to each frequency. The last one is the rms of the values
        without what is slower than a segment.
        """
        width_hz = self.frequency_hz[1] - self.frequency_hz[0]
        return numpy.asarray(numpy.sqrt(numpy.cumsum(self.power) * width_hz))


def density(values: ArrayLike, rate_hz: float, segments: int = SEGMENTS) -> Density:
    """The density of evenly spaced values by Welch's method; raises NotMeasured.

    The mean of all values is subtracted. The segments overlap by half, each has a Hann window, and
    the density is normalised by the power of the window, so that the mean square of the windowed
    values is the integral of the density (Parseval).
    """
    taken = numpy.asarray(values, dtype=float)
    length = 2 * len(taken) // (segments + 1)
    if length < FEWEST:
        raise NotMeasured(
            f"{len(taken)} values are too few for a density of {segments} segments: "
            f"{FEWEST * (segments + 1) // 2} at least"
        )
    window = numpy.hanning(length + 1)[:-1]  # periodic
    starts = [number * (length // 2) for number in range(segments)]
    parts = numpy.array([taken[start : start + length] for start in starts]) - taken.mean()
    power = (abs(numpy.fft.rfft(window * parts, axis=1)) ** 2).mean(axis=0)
    power *= 2 / (rate_hz * (window**2).sum())
    if length % 2 == 0:
        power[-1] /= 2  # the line at half the rate has no twin at a negative frequency
    frequency_hz = numpy.asarray(numpy.fft.rfftfreq(length, 1 / rate_hz), float)
    return Density(frequency_hz[1:], power[1:])


def allan_deviation(values: ArrayLike, rate_hz: float) -> tuple[Array, Array]:
    """Averaging times in s, in octaves, and the overlapping Allan deviation of evenly spaced values
    at each; raises NotMeasured.

    It is the rms difference of the means of two adjacent intervals of one averaging time, divided
    by sqrt(2). The longest averaging time is a third of all values.
    """
    taken = numpy.asarray(values, dtype=float)
    if len(taken) < FEWEST:
        raise NotMeasured(
            f"{len(taken)} values are too few for an Allan deviation: {FEWEST} at least"
        )
    sums = numpy.concatenate([[0.0], numpy.cumsum(taken - taken.mean())])
    lengths = 2 ** numpy.arange(int(numpy.log2(len(taken) / 3)) + 1)
    deviations = []
    for length in lengths:
        means = (sums[length:] - sums[:-length]) / length
        steps = means[length:] - means[:-length]
        deviations.append(numpy.sqrt((steps**2).mean() / 2))
    return lengths / rate_hz, numpy.array(deviations)


# ------------------------------------------------------------------ ISO 230-2


@dataclass(frozen=True)
class Positioning:
    """A test of positioning by ISO 230-2:2014: errors at target positions, approached several times
    from below (`up`) and from above (`down`), as arrays of (targets, runs). Raises NotMeasured.

    The standard plots position minus target; this project plots target minus position. Accuracy,
    repeatability and systematic deviation are the same in both. A reversal is that of the
    standard: the mean position reached from below minus that reached from above.
    """

    target: Array
    up: Array
    down: Array

    def __post_init__(self) -> None:
        shapes = {numpy.shape(self.up), numpy.shape(self.down)}
        targets, runs = (*numpy.shape(self.up), 0, 0)[:2]
        if shapes != {(len(self.target), runs)} or targets < 2 or runs < 2:
            raise NotMeasured(
                "a test of positioning has errors of at least 2 targets and 2 runs, and as many "
                "runs of every target from below as from above"
            )

    @property
    def mean_up(self) -> Array:
        """The mean error of each target from below."""
        return numpy.asarray(numpy.mean(self.up, axis=1))

    @property
    def mean_down(self) -> Array:
        """The mean error of each target from above."""
        return numpy.asarray(numpy.mean(self.down, axis=1))

    @property
    def scatter_up(self) -> Array:
        """The estimated standard deviation of each target from below."""
        return numpy.asarray(numpy.std(self.up, axis=1, ddof=1))

    @property
    def scatter_down(self) -> Array:
        """The estimated standard deviation of each target from above."""
        return numpy.asarray(numpy.std(self.down, axis=1, ddof=1))

    @property
    def reversals(self) -> Array:
        """The reversal value B_i of each target."""
        return self.mean_down - self.mean_up

    @property
    def reversal(self) -> float:
        """The reversal value B of the axis, the largest one without its sign."""
        return float(abs(self.reversals).max())

    @property
    def repeatability(self) -> float:
        """The bidirectional repeatability R: the largest R_i of all targets."""
        up, down = self.scatter_up, self.scatter_down
        both = 2 * up + 2 * down + abs(self.reversals)
        return float(numpy.max([both, 4 * up, 4 * down]))

    @property
    def systematic(self) -> float:
        """The bidirectional systematic deviation E."""
        return float(numpy.ptp([self.mean_up, self.mean_down]))

    @property
    def mean_deviation(self) -> float:
        """The range M of the means of both directions."""
        return float(numpy.ptp((self.mean_up + self.mean_down) / 2))

    @property
    def accuracy(self) -> float:
        """The bidirectional accuracy A: the range of all means with two standard deviations on
        either side.
        """
        up, down = self.scatter_up, self.scatter_down
        highest = numpy.max([self.mean_up + 2 * up, self.mean_down + 2 * down])
        lowest = numpy.min([self.mean_up - 2 * up, self.mean_down - 2 * down])
        return float(highest - lowest)


# ------------------------------------------------------------------ ISO 230-4

SECTORS = 360  # of a circle, in which paths of both directions are compared


@dataclass(frozen=True)
class Circle:
    """A test of a circular path by ISO 230-4:2005: points of the path, rows of X and Y from the
    programmed centre, of a full turn or more in each direction. Raises NotMeasured.
    """

    radius: float  # programmed
    counterclockwise: Array
    clockwise: Array

    def __post_init__(self) -> None:
        if any(numpy.isnan(self.radial(points)).any() for points in self.paths):
            raise NotMeasured(f"a path has no point in one of {SECTORS} sectors of the circle")

    @property
    def paths(self) -> tuple[Array, Array]:
        return self.counterclockwise, self.clockwise

    @property
    def centre(self) -> Array:
        """The centre of the circle that fits both paths best, by least squares."""
        points = numpy.concatenate(self.paths)
        found = numpy.zeros(2)
        for _ in range(5):  # Gauss-Newton: the deviations are small against the radius
            apart = points - found
            lengths = numpy.linalg.norm(apart, axis=1)
            slopes = numpy.column_stack([apart / lengths[:, None], numpy.ones(len(points))])
            found = found + numpy.linalg.lstsq(slopes, lengths - self.radius, rcond=None)[0][:2]
        return found

    def radial(self, points: Array, centre: ArrayLike = (0.0, 0.0)) -> Array:
        """The mean distance from a centre less the programmed radius, in each sector; NaN in one
        without a point.
        """
        apart = points - numpy.asarray(centre)
        turn = numpy.arctan2(apart[:, 1], apart[:, 0]) / (2 * numpy.pi) % 1
        sectors = (turn * SECTORS).astype(int) % SECTORS
        deviations = numpy.linalg.norm(apart, axis=1) - self.radius
        sums, counts = (
            numpy.bincount(sectors, weights, SECTORS)
            for weights in (deviations, numpy.ones(len(points)))
        )
        with numpy.errstate(invalid="ignore"):
            return numpy.asarray(sums / counts)

    def range_of(self, *paths: Array) -> float:
        """The radial distance of the two circles around the centre that enclose paths."""
        points = numpy.concatenate(paths) - self.centre
        return float(numpy.ptp(numpy.linalg.norm(points, axis=1)))

    @property
    def deviation(self) -> float:
        """The bidirectional circular deviation G(b)."""
        return self.range_of(*self.paths)

    @property
    def deviations(self) -> tuple[float, float]:
        """The circular deviations G of both directions, each from the centre of both."""
        return self.range_of(self.counterclockwise), self.range_of(self.clockwise)

    @property
    def hysteresis(self) -> float:
        """The circular hysteresis H: the largest distance between the two paths."""
        one, other = (self.radial(points, self.centre) for points in self.paths)
        return float(abs(one - other).max())

    @property
    def rms(self) -> float:
        """The root mean square of the distances of both paths from the circle that fits best; not
        in the standard, but no single point decides it.
        """
        points = numpy.concatenate(self.paths) - self.centre
        return float(numpy.std(numpy.linalg.norm(points, axis=1)))

    @property
    def radial_deviation(self) -> float:
        """The radial deviation F, the largest one of both paths without its sign: from the
        programmed circle around its programmed centre.
        """
        points = numpy.concatenate(self.paths)
        return float(abs(numpy.linalg.norm(points, axis=1) - self.radius).max())


# ------------------------------------------------------------------ motion and signals


def settling_time(time_s: ArrayLike, error: ArrayLike, window: float) -> float | None:
    """The time after which the error stays inside the window (at most `window`, either sign),
    counted from the first of these times; None if the last error is outside.
    """
    times = numpy.asarray(time_s, float)
    outside = numpy.flatnonzero(numpy.abs(error) > window)
    if not len(outside):
        return 0.0
    settled = int(outside[-1]) + 1
    return None if settled == len(times) else float(times[settled] - times[0])


def harmonics(turns: ArrayLike, error: ArrayLike, orders: int) -> Array:
    """The amplitudes of the orders 1 to `orders` of an error that depends on the phase of a signal,
    by least squares with a constant; raises NotMeasured.

    `turns` is the phase in signal periods. The phases should cover a period evenly.
    """
    phase, taken = 2 * numpy.pi * numpy.asarray(turns, float), numpy.asarray(error, float)
    if len(taken) < 2 * orders + 1 or len(phase) != len(taken):
        raise NotMeasured(
            f"{orders} harmonics need at least {2 * orders + 1} errors with their phases"
        )
    columns = [numpy.ones_like(phase)]
    for order in range(1, orders + 1):
        columns += [numpy.cos(order * phase), numpy.sin(order * phase)]
    found, _, rank, _ = numpy.linalg.lstsq(numpy.column_stack(columns), taken, rcond=None)
    if rank < len(columns):
        raise NotMeasured(f"the phases are too close together to tell {orders} harmonics apart")
    return numpy.asarray(numpy.hypot(found[1::2], found[2::2]))

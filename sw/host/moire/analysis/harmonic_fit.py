# SPDX-License-Identifier: Apache-2.0
"""Finds the harmonics that correct a circular grating, from readings against a reference (S1).

    readings = read_readings("ring.csv")    # angle in degrees; encoder minus reference in arcsec
    found = fit(readings)
    print(found.words())
    left = readings.error - found.at(readings.angle)

The error of an angle is a constant, plus the sum over the orders k of cosine_k cos(k angle) +
sine_k sin(k angle); the corrected angle is the angle less that sum. The constant depends on where
the reference has its zero, and is not corrected.

Readings at n angles, evenly round the circle, carry the orders below n / 2: at these angles, order
n - k looks like order k. Each order is weighted by signal / (signal + noise) (Wiener), so that an
order below the noise is left out rather than made worse. For the first three orders, which the
mounting makes, the power of the signal is taken from the order itself. Above them a single order
says little, and the power comes from the power law c / k^p that makes the observed powers, noise
included, most probable.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moire.columns import number, rows
from moire.errors import BadFile, OutOfRange

Array = NDArray[np.float64]

LARGEST_ERROR = 3600.0  # arcsec; no mounted ring has a larger one
MOST_ORDERS = 32  # as many as the relay evaluates
CLOSE = 1e-6  # degrees: closer readings are at the same angle
WIDEST_GAP = 1.6  # times the usual distance of two readings
OUTLIER = 8.0  # times the usual scatter around the fit
MOUNTING_ORDERS = 3  # eccentricity, tilt, distortion
FEWEST = 5  # readings
FEWEST_FOR_NOISE = 12  # degrees of freedom
FEWEST_FOR_DRIFT = 8  # orders that the readings carry
MOUNTING_POWER = 1e4  # arcsec squared, of a coefficient of the first orders: anything


@dataclass(frozen=True)
class Readings:
    """Readings in the order of the motion: arrays of equal length."""

    angle: Array  # degrees; it rises from one revolution to the next
    error: Array  # arcsec
    line: NDArray[np.int64]  # number of the line in the file
    name: str = "the readings"

    @property
    def angles(self) -> int:
        """The number of distinct angles on the circle."""
        return len(np.unique(on_circle(self.angle)))

    @property
    def revolutions(self) -> int:
        """The number of revolutions that the readings cover."""
        return max(1, round(float(self.angle[-1] - self.angle[0]) / 360))

    @property
    def most_orders(self) -> int:
        """How many orders these readings carry."""
        return (self.angles - 1) // 2


@dataclass(frozen=True)
class Harmonics:
    """The harmonics of an error, in arcsec; arrays by order, from 1."""

    cosine: Array
    sine: Array
    weight: Array  # 0 to 1: the share of each order that is used
    constant: float
    noise: float | None  # of one reading, rms; None: not known
    left: float  # largest error of the readings after correction
    before: float  # largest error of the readings before it
    angles: int  # number of distinct angles of the readings

    @property
    def orders(self) -> int:
        """The number of orders."""
        return len(self.cosine)

    @property
    def amplitude(self) -> Array:
        """The amplitude of each order, in arcsec."""
        amplitude: Array = np.hypot(self.cosine, self.sine)
        return amplitude

    def at(self, angle: ArrayLike) -> Array:
        """The error in arcsec at these angles (degrees), without the constant."""
        turn = np.radians(np.asarray(angle, dtype=float))
        total = np.zeros(turn.shape)
        for order, (cosine, sine) in enumerate(zip(self.cosine, self.sine, strict=True), start=1):
            total += cosine * np.cos(order * turn) + sine * np.sin(order * turn)
        return total

    def words(self) -> str:
        """The result in words, in several lines."""
        aliases = ", ".join(
            f"{self.angles - order} as {order}" for order in range(1, min(self.orders, 3) + 1)
        )
        noise = (
            "not known: one revolution does not show it"
            if self.noise is None
            else f"{self.noise:.2f} arcsec rms"
        )
        lines = [
            f"{self.orders} orders; noise of a reading {noise}",
            f"largest error {self.before:.2f} arcsec before, {self.left:.2f} after",
            "order   amplitude   phase / deg   weight",
        ]
        for order, (amplitude, cosine, sine, weight) in enumerate(
            zip(self.amplitude, self.cosine, self.sine, self.weight, strict=True), 1
        ):
            phase = math.degrees(math.atan2(cosine, sine))
            lines.append(f"{order:5}   {amplitude:9.3f}   {phase:+11.2f}   {weight:6.2f}")
        lines.append(
            f"{self.angles} angles cannot distinguish: order {aliases}"
            f"{', ...' if self.orders > 3 else ''}"
        )
        return "\n".join(lines)


def on_circle(angle: Array) -> NDArray[np.int64]:
    """A whole number for each angle, equal for angles at the same position on the circle."""
    steps: NDArray[np.int64] = np.round(angle % 360 / CLOSE).astype(np.int64)
    return steps % round(360 / CLOSE)


def read_readings(path: str | Path) -> Readings:
    """Reads a CSV file with an angle in degrees and an error in arcsec in each line.

    The readings are in the order of the motion; `#` begins a comment, and the first row may be a
    heading. An angle that falls back towards 0 begins the next revolution. Raises BadFile with the
    line that is wrong.
    """
    path = Path(path)
    angles: list[float] = []
    errors: list[float] = []
    lines: list[int] = []
    turn = 0
    for line, cells in rows(path)[1]:
        where = f"{path}, line {line}"
        if len(cells) != 2:
            raise BadFile(f"{where}: it needs two columns, angle and error, not {len(cells)}")
        angle, error = number(cells[0], "the angle", where), number(cells[1], "the error", where)
        if abs(error) > LARGEST_ERROR:
            raise BadFile(
                f"{where}: an error of {error:g} arcsec is absurd; at most {LARGEST_ERROR:g} are "
                "taken"
            )
        if not 0 <= angle <= 36000:
            raise BadFile(f"{where}: an angle of {angle:g} degrees is outside 0 to 36000")
        if angles:
            if angle + 360 * turn < angles[-1] - 180:
                turn += 1
            step = angle + 360 * turn - angles[-1]
            if abs(step) <= CLOSE and angle > CLOSE:
                raise BadFile(
                    f"{where}: the angle {angle:g} is there twice, also in line {lines[-1]}"
                )
            if step < -CLOSE:
                raise BadFile(
                    f"{where}: the angle {angle:g} comes after {angles[-1] - 360 * turn:g} in line "
                    f"{lines[-1]}: not in the order of the motion"
                )
        angles.append(angle + 360 * turn)
        errors.append(error)
        lines.append(line)
    if len(angles) < FEWEST:
        raise BadFile(f"{path}: {len(angles)} readings are too few; {FEWEST} at least")
    readings = Readings(np.array(angles), np.array(errors), np.array(lines), str(path))
    refuse_gaps(readings)
    refuse_outliers(readings)
    return readings


def refuse_gaps(readings: Readings) -> None:
    """Raises BadFile where a reading is missing."""
    steps = np.diff(readings.angle)
    usual = float(np.median(steps[steps > CLOSE]))
    for at in np.flatnonzero(steps > WIDEST_GAP * usual):
        raise BadFile(
            f"{readings.name}, line {readings.line[at + 1]}: from {readings.angle[at]:g} to "
            f"{readings.angle[at + 1]:g} degrees a reading is missing; the others are {usual:g} "
            "degrees apart"
        )
    covered = readings.angle[-1] - readings.angle[0]
    if covered < 360 - WIDEST_GAP * usual:
        raise BadFile(
            f"{readings.name}: the readings cover {covered:g} degrees; a whole revolution is needed"
        )


def refuse_outliers(readings: Readings) -> None:
    """Raises BadFile for a reading that no smooth ring gives.

    It is far from a fit of the low orders, compared with the scatter of the other readings.
    """
    orders = min(8, readings.most_orders // 2)
    left = readings.error - design(readings.angle, orders) @ least_squares(readings, orders)
    usual = 1.4826 * float(np.median(np.abs(left))) + 0.01
    worst = int(np.argmax(np.abs(left)))
    if abs(left[worst]) > OUTLIER * usual:
        raise BadFile(
            f"{readings.name}, line {readings.line[worst]}: the error {readings.error[worst]:g} "
            f"arcsec at {readings.angle[worst]:g} degrees is {abs(left[worst]):.1f} off what the "
            f"other readings say; they scatter by {usual:.1f}"
        )


def design(angle: Array, orders: int) -> Array:
    """The matrix of the fit: columns 1, and cos and sin of each order."""
    turn = np.radians(angle)[:, None] * np.arange(1, orders + 1)
    return np.hstack(
        [
            np.ones((len(turn), 1)),
            np.stack([np.cos(turn), np.sin(turn)], axis=2).reshape(len(turn), 2 * orders),
        ]
    )


def least_squares(readings: Readings, orders: int) -> Array:
    """The constant, and cosine and sine of each order."""
    solved, *_ = np.linalg.lstsq(design(readings.angle, orders), readings.error, rcond=None)
    return np.asarray(solved, np.float64)


def noise_of(readings: Readings, residual: Array, orders: int) -> float | None:
    """The noise of one reading, rms in arcsec.

    It comes from the differences between readings at the same angle, or from the residual of the
    fit; None where there are too few of both to distinguish noise from orders.
    """
    _, which, count = np.unique(on_circle(readings.angle), return_inverse=True, return_counts=True)
    repeated = len(readings.error) - len(count)
    left = len(readings.error) - 1 - 2 * orders
    if repeated >= FEWEST_FOR_NOISE:
        mean = np.bincount(which, readings.error) / count
        return math.sqrt(float(np.sum((readings.error - mean[which]) ** 2)) / repeated)
    return math.sqrt(float(np.sum(residual**2)) / left) if left >= FEWEST_FOR_NOISE else None


def signal_power(power: Array, floor: float) -> Array:
    """The power of the signal in each order, without the noise.

    `power` is as fitted; each is distributed exponentially with the mean signal + floor.
    """
    order = np.arange(1, len(power) + 1)
    single: Array = np.maximum(power - floor, 0.0)
    high = order > MOUNTING_ORDERS
    if np.count_nonzero(high) < 4:
        return single
    best, law = math.inf, single
    for slope in np.arange(0, 4.01, 0.25):
        for scale in np.geomspace(1e-3, 1e5, 160) * max(floor, 1e-9):
            candidate = scale * order**-slope
            mean = candidate[high] + floor
            unlikely = float(np.sum(np.log(mean) + power[high] / mean))
            if unlikely < best:
                best, law = unlikely, candidate
    return np.where(high, law, single)


def fit(
    readings: Readings, orders: int | None = None, noise: float | None = None, weighted: bool = True
) -> Harmonics:
    """The harmonics of these readings; raises OutOfRange.

    Without `orders` it finds as many as the readings carry. `noise` is the rms of a reading in
    arcsec, estimated if None. With weighted=False it is the plain least-squares fit of the paper.
    """
    most = min(readings.most_orders, MOST_ORDERS)
    if orders is None:
        orders = most
    if not 1 <= orders <= most:
        raise OutOfRange(f"{readings.angles} angles carry 1 to {most} orders, not {orders}")
    solved = least_squares(readings, orders)
    cosine, sine = solved[1::2], solved[2::2]
    residual = readings.error - design(readings.angle, orders) @ solved
    power = cosine**2 + sine**2
    if noise is None and weighted:
        noise = noise_of(readings, residual, orders)
    floor = 4 * noise**2 / len(readings.error) if noise and weighted else 0.0
    signal = signal_power(power, floor) if floor else power
    weight = signal / np.maximum(signal + floor, 1e-30)
    solved[1:] *= np.repeat(weight, 2)
    return harmonics(readings, solved, weight, noise)


def fit_drifting(
    readings: Readings, orders: int, noise: float, drift: float, lasting: float
) -> Harmonics:
    """The most probable harmonics of readings that drift slowly; raises OutOfRange.

    `noise` is the rms of a reading in arcsec without the drift, `drift` that of the drift, whose
    correlation falls by e in `lasting` readings. All orders that the relay can have take part, also
    those that the readings do not carry; above the first three they have the power law that fit()
    finds. A drift is told from the low orders if each reading is some 50 degrees from the last
    one, over several turns; then it looks like orders that are small.
    """
    if not 1 <= orders <= MOST_ORDERS:
        raise OutOfRange(f"1 to {MOST_ORDERS} orders, not {orders}")
    carried = min(readings.most_orders, MOST_ORDERS)
    if carried < FEWEST_FOR_DRIFT:
        raise OutOfRange(
            f"{readings.angles} angles carry {carried} orders; to tell a drift from them it takes "
            f"{FEWEST_FOR_DRIFT}"
        )
    solved = least_squares(readings, carried)
    count = len(readings.error)
    power = signal_power(solved[1::2] ** 2 + solved[2::2] ** 2, 4 * (noise**2 + drift**2) / count)
    first, last = MOUNTING_ORDERS + 1, carried
    slope = math.log(power[first - 1] / power[last - 1]) / math.log(last / first)
    order = np.arange(1, MOST_ORDERS + 1)
    variance = np.where(
        order < first, MOUNTING_POWER, power[first - 1] * (order / first) ** -slope / 2
    )
    prior = np.concatenate([[MOUNTING_POWER], np.repeat(variance, 2)])
    matrix = design(readings.angle, MOST_ORDERS)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    scatter = drift**2 * np.exp(-apart / lasting) + noise**2 * np.eye(count)
    gain = prior[:, None] * np.linalg.solve((matrix * prior) @ matrix.T + scatter, matrix).T
    known = np.einsum("ij,ji->i", gain, matrix)  # the share of each coefficient that is known
    found = (gain @ readings.error)[: 1 + 2 * orders]
    weight = (known[1::2] + known[2::2])[:orders] / 2
    return harmonics(readings, found, weight, math.hypot(noise, drift))


def harmonics(readings: Readings, solved: Array, weight: Array, noise: float | None) -> Harmonics:
    """The harmonics with these coefficients of the columns of design()."""
    constant, cosine, sine = solved[0], solved[1::2], solved[2::2]
    made = Harmonics(
        cosine,
        sine,
        weight,
        float(constant),
        noise,
        0.0,
        float(np.max(np.abs(readings.error))),
        readings.angles,
    )
    left = readings.error - constant - made.at(readings.angle)
    return replace(made, left=float(np.max(np.abs(left))))

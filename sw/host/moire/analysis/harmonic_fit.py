# SPDX-License-Identifier: Apache-2.0
"""From readings of a circular grating against a reference to the harmonics that correct it (S1).

    readings = read_readings("ring.csv")            # angle in degrees, error in arc seconds:
                                                    encoder minus reference
    found = fit(readings)
    print(found.words())
    left = readings.error - found.at(readings.angle)

error(angle) = constant + sum over the orders k of cosine_k cos(k angle) + sine_k sin(k angle); the
corrected angle is the angle
less that sum. The constant is where the reference put its zero, and is not corrected.

n places evenly round the circle carry the orders below n / 2; order n - k looks there as order k
does. Each order is weighted by
signal / (signal + noise) (Wiener): what drowns in noise is left out rather than put in. The power
of the signal is taken from
the order itself for the first three, which mounting makes; above, where a single order says little,
from the power law
c / k^p that makes the powers seen, noise included, most probable.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from moire.columns import number, rows
from moire.errors import BadFile, OutOfRange

LARGEST_ERROR = 3600.0  # arc seconds; a ring that is farther off is not mounted, it has fallen down
MOST_ORDERS = 32  # that the relay evaluates
CLOSE = 1e-6  # degrees: readings at one place
WIDEST_GAP = 1.6  # times the usual distance of two readings
OUTLIER = 8.0  # times the usual scatter around the fit
MOUNTING_ORDERS = 3  # eccentricity, tilt, distortion
FEWEST = 5  # readings
FEWEST_FOR_NOISE = 12  # degrees of freedom


@dataclass(frozen=True)
class Readings:
    """Arrays of one length. angle grows from one revolution to the next; line: where in the file
    each one stands.
    """

    angle: np.ndarray  # degrees
    error: np.ndarray  # arc seconds
    line: np.ndarray
    name: str = "the readings"

    @property
    def places(self) -> int:
        """Distinct places on the circle."""
        return len(
            np.unique(np.round(self.angle % 360 / CLOSE).astype(np.int64) % round(360 / CLOSE))
        )

    @property
    def revolutions(self) -> int:
        return max(1, round((self.angle[-1] - self.angle[0]) / 360))

    @property
    def most_orders(self) -> int:
        return (self.places - 1) // 2


@dataclass(frozen=True)
class Harmonics:
    """Arrays by order, from 1; arc seconds."""

    cosine: np.ndarray
    sine: np.ndarray
    weight: np.ndarray  # 0 to 1: what the noise left of each
    constant: float
    noise: float | None  # of one reading, rms; None: not known
    left: float  # largest error of the readings after correction
    before: float  # and before it
    places: int

    @property
    def orders(self) -> int:
        return len(self.cosine)

    @property
    def amplitude(self) -> np.ndarray:
        return np.hypot(self.cosine, self.sine)

    def at(self, angle) -> np.ndarray:
        """The error at these angles (degrees), without the constant."""
        turn = np.radians(np.asarray(angle, dtype=float))
        total = np.zeros(turn.shape)
        for order, (cosine, sine) in enumerate(zip(self.cosine, self.sine, strict=True), start=1):
            total += cosine * np.cos(order * turn) + sine * np.sin(order * turn)
        return total

    def words(self) -> str:
        aliases = ", ".join(
            f"{self.places - order} as {order}" for order in range(1, min(self.orders, 3) + 1)
        )
        noise = (
            "not known: one revolution does not tell it"
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
            f"{self.places} places cannot tell apart: order {aliases}{', ...' if self.orders > 3 else ''}"
        )
        return "\n".join(lines)


def read_readings(path) -> Readings:
    """A table `angle in degrees, error in arc seconds`, one reading a line, in the order of the
    motion; `#` begins a comment, a
    heading may stand above. An angle that falls back towards 0 begins the next revolution. What is
    wrong is told with its line."""
    path = Path(path)
    angles, errors, lines, turn = [], [], [], 0
    for line, cells in rows(path)[1]:
        where = f"{path}, line {line}"
        if len(cells) != 2:
            raise BadFile(f"{where}: two columns are wanted, angle and error, not {len(cells)}")
        angle, error = number(cells[0], "the angle", where), number(cells[1], "the error", where)
        if abs(error) > LARGEST_ERROR:
            raise BadFile(
                f"{where}: an error of {error:g} arcsec is absurd; at most {LARGEST_ERROR:g} are taken"
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
                    f"{where}: the angle {angle:g} comes after {angles[-1] - 360 * turn:g} in line {lines[-1]}: "
                    "not in the order of the motion"
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


def refuse_gaps(readings: Readings):
    steps = np.diff(readings.angle)
    usual = float(np.median(steps[steps > CLOSE]))
    for at in np.flatnonzero(steps > WIDEST_GAP * usual):
        raise BadFile(
            f"{readings.name}, line {readings.line[at + 1]}: from {readings.angle[at]:g} to {readings.angle[at + 1]:g} degrees "
            f"a reading is missing; the others are {usual:g} degrees apart"
        )
    way = readings.angle[-1] - readings.angle[0]
    if way < 360 - WIDEST_GAP * usual:
        raise BadFile(
            f"{readings.name}: the readings cover {way:g} degrees; a whole revolution is wanted"
        )


def refuse_outliers(readings: Readings):
    """A reading that no smooth ring gives: far off what the low orders say, as the others measure
    `far`.
    """
    orders = min(8, readings.most_orders // 2)
    rest = readings.error - design(readings.angle, orders) @ least_squares(readings, orders)
    usual = 1.4826 * float(np.median(np.abs(rest))) + 0.01
    worst = int(np.argmax(np.abs(rest)))
    if abs(rest[worst]) > OUTLIER * usual:
        raise BadFile(
            f"{readings.name}, line {readings.line[worst]}: the error {readings.error[worst]:g} arcsec at "
            f"{readings.angle[worst]:g} degrees is {abs(rest[worst]):.1f} off what the other readings say; "
            f"they scatter by {usual:.1f}"
        )


def design(angle, orders: int) -> np.ndarray:
    """Columns 1, cos, sin of each order."""
    turn = np.radians(angle)[:, None] * np.arange(1, orders + 1)
    return np.hstack(
        [
            np.ones((len(turn), 1)),
            np.stack([np.cos(turn), np.sin(turn)], axis=2).reshape(len(turn), 2 * orders),
        ]
    )


def least_squares(readings: Readings, orders: int) -> np.ndarray:
    return np.linalg.lstsq(design(readings.angle, orders), readings.error, rcond=None)[0]


def noise_of(readings: Readings, rest: np.ndarray, orders: int) -> float | None:
    """rms of one reading: from what differs between readings of one place, or from what the fit
    left over; None where there is too
    little of both to tell noise from orders."""
    place = np.round(readings.angle % 360 / CLOSE).astype(np.int64) % round(360 / CLOSE)
    _, which, count = np.unique(place, return_inverse=True, return_counts=True)
    repeated = len(readings.error) - len(count)
    left = len(readings.error) - 1 - 2 * orders
    if repeated >= FEWEST_FOR_NOISE:
        mean = np.bincount(which, readings.error) / count
        return math.sqrt(float(np.sum((readings.error - mean[which]) ** 2)) / repeated)
    return math.sqrt(float(np.sum(rest**2)) / left) if left >= FEWEST_FOR_NOISE else None


def signal_power(power: np.ndarray, floor: float) -> np.ndarray:
    """Of each order, without the noise that lies under it. power: as fitted; each is exponential
    with the mean signal + floor.
    """
    order = np.arange(1, len(power) + 1)
    single = np.maximum(power - floor, 0.0)
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
    """The harmonics of these readings: `orders` of them, as many as they carry if None. noise: rms
    of a reading in arc seconds,
    estimated if None. weighted False is the plain least-squares fit of the paper."""
    most = min(readings.most_orders, MOST_ORDERS)
    if orders is None:
        orders = most
    if not 1 <= orders <= most:
        raise OutOfRange(f"{readings.places} places carry 1 to {most} orders, not {orders}")
    solved = least_squares(readings, orders)
    constant, cosine, sine = solved[0], solved[1::2], solved[2::2]
    rest = readings.error - design(readings.angle, orders) @ solved
    power = cosine**2 + sine**2
    if noise is None and weighted:
        noise = noise_of(readings, rest, orders)
    floor = 4 * noise**2 / len(readings.error) if noise and weighted else 0.0
    signal = signal_power(power, floor) if floor else power
    weight = signal / np.maximum(signal + floor, 1e-30)
    made = Harmonics(
        cosine * weight,
        sine * weight,
        weight,
        float(constant),
        noise,
        0.0,
        float(np.max(np.abs(readings.error))),
        readings.places,
    )
    return replace(
        made, left=float(np.max(np.abs(readings.error - constant - made.at(readings.angle))))
    )

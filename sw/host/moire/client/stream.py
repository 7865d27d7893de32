# SPDX-License-Identifier: Apache-2.0
"""Streams of set-points: a table of time, position and velocity that an axis plays.

    with open_bus("/dev/ttyUSB0") as bus, bus.axis(1) as axis:
        axis.enable()
        axis.home()
        axis.stream(read_points("path.csv"))

Between two points the target follows the cubic that has their positions and velocities. The node
computes it; the host sends it a point of that cubic every STREAM_LONGEST ticks or more often.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from moire import units
from moire.columns import number, rows
from moire.errors import BadFile, OutOfRange, UnitError
from moire.made.bus_tables import STREAM_LONGEST, STREAM_SHORTEST, STREAM_TOLERANCE

FINE = 1 << 40  # units of a velocity on the bus in a period per tick
TOLERANCE = Fraction(1, 1 << STREAM_TOLERANCE)  # of the node's limits
REMEDY = "its firmware plays no streams; build the image stream (docs/stream.md)"
NO_NUMBERS = ("nan", "inf", "infinity")  # which a plain number may be, too
COLUMNS = (  # of a file, with the units of plain numbers
    ("time", units.TIME, "ms"),
    ("position", units.LENGTH, "mm"),
    ("velocity", units.SPEED, "mm/s"),
)


@dataclass(frozen=True)
class Point:
    """A point of a path; `where` says where it was written."""

    time_s: Fraction
    position_nm: Fraction
    velocity_mm_s: Fraction
    where: str = ""


@dataclass(frozen=True)
class SetPoint:
    """What is sent to the node. `point` is the row that it leads to."""

    tick: int
    position: int  # 2^-16 period
    velocity: int  # 2^-40 period per tick
    point: Point


@dataclass(frozen=True)
class Limits:
    """The limits of an axis in mm/s and mm/s2."""

    velocity: Fraction
    acceleration: Fraction


class Cubic:
    """The path from one point to the next, in nm and s."""

    def __init__(self, begin: Point, end: Point):
        self.begin, self.end = begin, end
        self.time = time = end.time_s - begin.time_s
        distance = (end.position_nm - begin.position_nm) / 10**6
        first, last = begin.velocity_mm_s, end.velocity_mm_s
        self.acceleration = (6 * distance - time * (4 * first + 2 * last)) / time**2
        self.jerk = (6 * time * (first + last) - 12 * distance) / time**3

    def position_nm(self, s: Fraction) -> Fraction:
        """The position so long after the beginning."""
        first = self.begin.velocity_mm_s
        mm = s * (first + s * (self.acceleration / 2 + s * self.jerk / 6))
        return self.begin.position_nm + 10**6 * mm

    def velocity_mm_s(self, s: Fraction) -> Fraction:
        """The velocity so long after the beginning."""
        return self.begin.velocity_mm_s + s * (self.acceleration + s * self.jerk / 2)

    def largest_acceleration(self) -> Fraction:
        """It is at one of the ends; mm/s2."""
        return max(abs(self.acceleration), abs(self.acceleration + self.jerk * self.time))

    def largest_velocity(self) -> Fraction:
        """It is at one of the ends, or where the acceleration is 0; mm/s."""
        times = [Fraction(0), self.time]
        if self.jerk and 0 < -self.acceleration / self.jerk < self.time:
            times.append(-self.acceleration / self.jerk)
        return max(abs(self.velocity_mm_s(s)) for s in times)


def checked(points: Iterable[Point]) -> list[Point]:
    """The points; raises OutOfRange unless they are a path from rest to rest."""
    found = list(points)
    if len(found) < 2:
        raise OutOfRange(f"a stream needs two points at least, not {len(found)}")
    for which, point in (("first", found[0]), ("last", found[-1])):
        if point.velocity_mm_s:
            raise OutOfRange(
                f"{named(point)}: the {which} point has the velocity "
                f"{units.format_speed(point.velocity_mm_s)}; it must be 0, at rest"
            )
    for before, point in pairwise(found):
        if point.time_s <= before.time_s:
            raise OutOfRange(
                f"{named(point)}: the time {units.format_time(point.time_s)} does not come after "
                f"{units.format_time(before.time_s)}"
            )
    return found


def check_limits(points: Sequence[Point], limits: Limits) -> None:
    """Raises OutOfRange if the path between two points exceeds the limits of the axis."""
    for before, point in pairwise(points):
        cubic = Cubic(before, point)
        velocity, acceleration = cubic.largest_velocity(), cubic.largest_acceleration()
        if velocity > limits.velocity:
            raise OutOfRange(
                f"{named(point)}: on the way to it the velocity is "
                f"{units.format_speed(velocity)}; the parameter velocity allows "
                f"{units.format_speed(limits.velocity)}"
            )
        if acceleration > limits.acceleration * (1 + TOLERANCE):
            raise OutOfRange(
                f"{named(point)}: on the way to it the acceleration is "
                f"{units.with_unit(units.ACCELERATION, acceleration, 6)}; the parameter "
                "acceleration allows "
                f"{units.with_unit(units.ACCELERATION, limits.acceleration, 6)}"
            )


def set_points(points: Sequence[Point], period_nm: Fraction, tick_hz: int) -> list[SetPoint]:
    """What is sent for a path, from the second point on; the first is where the axis is at rest.

    A time that is no whole number of ticks is rounded, and the set-point is where the path is at
    that tick. Raises OutOfRange if two points are fewer than STREAM_SHORTEST ticks apart.
    """
    found: list[SetPoint] = []
    start, end = points[0].time_s, points[-1]
    tick = 0
    cubics = [Cubic(before, point) for before, point in pairwise(points)]
    for n, cubic in enumerate(cubics):
        begin, until = tick, round((cubic.end.time_s - start) * tick_hz)
        ticks = until - begin
        if ticks < STREAM_SHORTEST:
            raise OutOfRange(
                f"{named(cubic.end)}: it is {units.format_time(cubic.time)} after the point "
                f"before; points must be {units.format_time(Fraction(STREAM_SHORTEST, tick_hz))} "
                "apart at least"
            )
        parts = -(-ticks // STREAM_LONGEST)
        for part in range(1, parts + 1):
            tick = begin + ticks * part // parts
            time = start + Fraction(tick, tick_hz)
            # a rounded time may lie in the cubic that follows
            path = cubics[n + 1] if time > cubic.end.time_s and n + 1 < len(cubics) else cubic
            if cubic.end is end and part == parts:
                position, velocity = end.position_nm, Fraction(0)
            else:
                s = time - path.begin.time_s
                position, velocity = path.position_nm(s), path.velocity_mm_s(s)
            found.append(
                SetPoint(
                    tick,
                    round(position * 65536 / period_nm),
                    round(velocity * 10**6 * FINE / (period_nm * tick_hz)),
                    cubic.end,
                )
            )
    return found


def named(point: Point) -> str:
    """How an error names a point."""
    return point.where or f"the point at {units.format_time(point.time_s)}"


def read_points(path: str | Path) -> list[Point]:
    """Reads a CSV file with the columns time, position and velocity, and a line for each point.

    Plain numbers are ms, mm and mm/s unless the heading names other units. Raises BadFile with the
    line that is wrong.
    """
    path = Path(path)
    heading, found = rows(path)
    points = []
    for line, cells in found:
        where = f"{path}, line {line}"
        if len(cells) != len(COLUMNS):
            raise BadFile(
                f"{where}: it needs three columns, time, position and velocity, not {len(cells)}"
            )
        time, position, velocity = (
            value_of(cell, column, heading[n] if n < len(heading) else "", where)
            for n, (cell, column) in enumerate(zip(cells, COLUMNS, strict=True))
        )
        points.append(Point(time, position, velocity, where))
    try:
        return checked(points)
    except OutOfRange as error:
        raise BadFile(str(error) if points else f"{path}: {error}") from None


def value_of(
    cell: str, column: tuple[str, units.Quantity, str], title: str, where: str
) -> Fraction:
    """The value of a cell in the base unit of its quantity."""
    name, quantity, unit = column
    written = re.search(r"[/(\[]\s*([A-Za-zµμ]+(?:/[A-Za-z]+)?)", title)
    if written:
        unit = written[1].translate(units.SPELLINGS)
        if unit not in quantity.worth:
            raise BadFile(
                f"{where}: the heading gives the {name} in {unit}, which is no unit of it: write "
                f"{quantity.allowed()}"
            )
    text = cell.strip()
    if text[-1:].isalpha() and text.lower().lstrip("+-") not in NO_NUMBERS:
        try:
            return quantity.parse(text)
        except UnitError as error:
            raise BadFile(f"{where}: {error}") from None
    number(text, f"the {name}", where)  # a finite number
    return Fraction(text) * quantity.worth[unit]

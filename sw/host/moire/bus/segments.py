# SPDX-License-Identifier: Apache-2.0
"""The segment table of an axis (S0): the error of its scale at the borders of equal segments, taken
off every position.

    table = read_table("scale.csv")                # position, error: what the scale shows there
                                                   less the true place
    with SerialBus("/dev/ttyUSB0") as port:
        segments = Segments(Bus(port).axis(address=1))
        segments.load(table, "linear")
        print(segments.status().words())

The table lies on the scale: its places count from the one that homing finds, so it is in force only
while the axis has a zero.
"""

import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from moire import units
from moire.bus.columns import number, rows
from moire.errors import BadFile, MoireError, OutOfRange
from moire.made.bus_tables import CAUSES
from moire.units import LENGTHS, SPELLINGS, format_length

USES = ("off", "rectangle", "linear")  # values of the parameter `segments`
COUNTS = 65536  # of the wire, in one signal period
LARGEST_POINT = (1 << 23) - 1  # of the wire
BLOCK = 12  # points of a body
PATIENCE_S = 0.5  # until a use that was asked for is in force
STEEPEST = Fraction(1, 100)  # of a segment, from border to border: no scale is farther off
UNEQUAL = Fraction(1, 1000)  # of a segment: how far a border may lie from its place
MISSING = Fraction(3, 2)  # segments: a border has been left out
PLAIN = ("mm", "nm")  # units of plain numbers in the two columns, where the heading names none


class NotInForce(MoireError):
    """The table is in the node, but corrects nothing."""


@dataclass(frozen=True)
class SegmentTable:
    """Exact, in nm."""

    first: Fraction  # position of the first border
    length: Fraction  # of a segment
    errors: tuple  # at the borders: position there less the true one

    @property
    def segments(self) -> int:
        return len(self.errors) - 1

    def at(self, position, use: str = "linear") -> Fraction:
        """What is taken off a position (nm)."""
        place = (Fraction(position) - self.first) / self.length
        index = min(max(place.__floor__(), 0), self.segments - 1)
        low, high = self.errors[index : index + 2]
        if not 0 <= place < self.segments:
            return low if place < 0 else high
        return (low + high) / 2 if use == "rectangle" else low + (high - low) * (place - index)


@dataclass(frozen=True)
class SegmentStatus:
    built: int  # most segments; 0: the node has no table
    loaded: int  # points
    in_force: str  # one of USES
    reason: str  # a cause: why the use that is wanted is not in force, or "ok"
    outside: bool  # the position is beyond the table
    error_nm: float  # taken off now

    def words(self) -> str:
        if not self.built:
            return "this node was built without a segment table"
        why = "" if self.reason == "ok" else f": {dict(CAUSES.values())[self.reason]}"
        if self.in_force == "off":
            return f"off{why}; {self.loaded} points loaded, at most {self.built + 1}"
        beyond = ", beyond the table" if self.outside else ""
        return f"{self.in_force}{why}; {format_length(self.error_nm, 4)} taken off the position{beyond}; {self.loaded} points loaded"


def column_unit(heading: list, column: int) -> Fraction:
    """In nm, of the plain numbers of a column: the heading's unit, as in `position / mm` or `error
    (nm)`.
    """
    words = heading[column].translate(SPELLINGS) if column < len(heading) else ""
    named = [unit for unit in re.findall(r"[A-Za-z]+", words)[1:] if unit in LENGTHS]
    return LENGTHS[named[-1] if named else PLAIN[column]]


def length_of(text: str, unit: Fraction, what: str, where: str) -> Fraction:
    """In nm: with its own unit, or a plain number."""
    try:
        return units.parse_length(text)
    except units.UnitError:
        if re.search(r"[A-Za-z]", re.sub(r"[eE][+-]?[0-9]+|nan|inf\w*", "", text)):
            raise BadFile(f"{where}: {what} is no length: {text.strip()!r}") from None
    return Fraction(str(number(text, what, where))) * unit


def read_table(path) -> SegmentTable:
    """Two columns, position and error, a border a line, at equal distances and going up; plain
    numbers are mm and nm unless the
    heading says otherwise. What is wrong is told with its line."""
    path = Path(path)
    heading, found = rows(path)
    places, errors, lines = [], [], []
    for line, cells in found:
        where = f"{path}, line {line}"
        if len(cells) != 2:
            raise BadFile(f"{where}: two columns are wanted, position and error, not {len(cells)}")
        place, error = (
            length_of(cell, column_unit(heading, n), what, where)
            for n, (cell, what) in enumerate(zip(cells, ("the position", "the error"), strict=True))
        )
        if places and place == places[-1]:
            raise BadFile(
                f"{where}: the position {format_length(place)} is there twice, also in line {lines[-1]}"
            )
        if places and place < places[-1]:
            raise BadFile(
                f"{where}: the position {format_length(place)} comes after {format_length(places[-1])} in line {lines[-1]}: "
                "they must go up"
            )
        places.append(place)
        errors.append(error)
        lines.append(line)
    if len(places) < 2:
        raise BadFile(f"{path}: {len(places)} borders are too few; 2 at least")
    usual = sorted(b - a for a, b in zip(places, places[1:]))[(len(places) - 1) // 2]
    for n in range(1, len(places)):
        where, step = f"{path}, line {lines[n]}", places[n] - places[n - 1]
        if step > MISSING * usual:
            raise BadFile(
                f"{where}: from {format_length(places[n - 1])} to {format_length(places[n])} a border is missing; the others "
                f"are {format_length(usual)} apart"
            )
        if abs(places[n] - places[0] - n * usual) > UNEQUAL * usual * n:
            raise BadFile(
                f"{where}: {format_length(places[n])} is no border of equal segments of {format_length(usual)} from "
                f"{format_length(places[0])} on"
            )
        if abs(errors[n] - errors[n - 1]) > STEEPEST * usual:
            raise BadFile(
                f"{where}: an error of {format_length(errors[n])} after {format_length(errors[n - 1])} is absurd: no scale is "
                f"off by {float(STEEPEST):.0%} of a segment"
            )
    return SegmentTable(places[0], (places[-1] - places[0]) / (len(places) - 1), tuple(errors))


def text_of(table: SegmentTable) -> str:
    """The file that read_table() reads back, digit by digit."""
    places = (table.first + n * table.length for n in range(table.segments + 1))
    lines = [
        f"{units.decimal(place / LENGTHS['mm'])}, {units.decimal(error)}"
        for place, error in zip(places, table.errors, strict=True)
    ]
    return "\n".join(["position / mm, error / nm", *lines, ""])


def check_use(use: str):
    if use not in USES:
        raise OutOfRange(f"a segment table has no use '{use}': known are {', '.join(USES)}")


class Segments:
    """The segment table of an Axis."""

    def __init__(self, axis):
        self.axis = axis

    def status(self) -> SegmentStatus:
        told, state = self.axis.request("segments"), self.axis.feedback("segment_state")
        error = self.axis.feedback("segment_error")["value"]
        return SegmentStatus(
            state["built"],
            told["loaded"],
            USES[told["in_force"]],
            CAUSES[told["reason"]][0],
            bool(state["outside"]),
            self.axis.to_nm(error),
        )

    def use(self, use: str) -> SegmentStatus:
        """ "off", "rectangle" or "linear", at once for an axis that rests; its position is then
        told on the other scale, and its target
        with it. What is not in force yet says why."""
        check_use(use)
        self.axis.set_parameter("segments", use)
        end = self.axis.transport.now() + PATIENCE_S
        while (status := self.status()).reason == "busy" and self.axis.transport.now() < end:
            self.axis.transport.wait(self.axis.node.bus.poll_s)
        return status

    def read_points(self) -> list:
        """Those that are loaded, in counts of the wire."""
        loaded, points = self.axis.request("segments")["loaded"], []
        while len(points) < loaded:
            points += self.axis.request("get_segments", border=len(points)).values()
        return points[:loaded]

    def write_points(self, points: list):
        """In counts of the wire, in the place of the old ones, and read back; the table is off from
        here on.
        """
        self.check_points(points)
        self.use("off")
        for border in range(0, len(points), BLOCK):
            block = points[border : border + BLOCK]
            self.axis.request(
                "set_segments",
                border=border,
                points=len(block),
                **{
                    f"point_{n}": point
                    for n, point in enumerate(block + [0] * (BLOCK - len(block)))
                },
            )
        if self.read_points() != points:
            raise NotInForce("the node does not hold the segment table that was written; it is off")

    def check_points(self, points: list):
        """OutOfRange if the node cannot take them."""
        most = self.axis.feedback("segment_state")["built"]
        if not 2 <= len(points) <= most + 1:
            raise OutOfRange(
                f"{len(points)} points are too few or too many: this node's segment table takes 2 to {most + 1}"
                if most
                else "this node was built without a segment table"
            )
        if any(abs(point) > LARGEST_POINT for point in points):
            raise OutOfRange(
                f"an error in the table is above {format_length(self.axis.to_nm(LARGEST_POINT), 4)}: 128 periods are the most"
            )

    def load(self, table: SegmentTable, use: str = "linear") -> SegmentStatus:
        """A new table in the place of the old one, and its use. All of it is checked before the old
        one is given up.
        """
        axis, points = self.axis, [self.axis.to_counts(error) for error in table.errors]
        self.check_points(points)
        geometry = {
            "segment_count": table.segments,
            "segment_length": table.length,
            "segment_first": table.first - self.zero(),
        }
        counts = {name: axis.parameter_counts(name, value) for name, value in geometry.items()}
        check_use(use)
        self.write_points(points)
        for name, count in counts.items():
            axis.write_parameter(name, count)
        return self.use(use)

    def read(self) -> SegmentTable:
        """What the node holds."""
        points = self.read_points()
        if len(points) < 2:
            raise NotInForce("no segment table is loaded")
        count, length, first = (
            self.axis.get_parameter(name).value
            for name in ("segment_count", "segment_length", "segment_first")
        )
        return SegmentTable(
            first + self.zero(),
            length,
            tuple(point * self.axis.period_nm / COUNTS for point in points[: int(count) + 1]),
        )

    def zero(self) -> Fraction:
        """What the place that homing finds is called, in nm."""
        return self.axis.get_parameter("home_offset").value

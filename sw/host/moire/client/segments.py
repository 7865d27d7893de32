# SPDX-License-Identifier: Apache-2.0
"""The segment table of an axis (S0), which corrects the error of its scale.

The table holds the error at the borders of equal segments; the axis subtracts it from every
position.

    table = read_table("scale.csv")     # position and error: shown position less the true one
    with SerialBus("/dev/ttyUSB0") as port:
        segments = Segments(Bus(port).axis(address=1))
        segments.load(table, "linear")
        print(segments.status().words())

The positions of the table count from the zero that homing finds, so the table is in force only
while the axis is homed.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from statistics import median_low

from moire import units
from moire.client.axis import Axis
from moire.client.built import remedy
from moire.columns import number, rows
from moire.errors import BadFile, MoireError, OutOfRange, UnitError
from moire.made.bus_tables import CAUSES
from moire.units import LENGTHS, SPELLINGS, format_length

USES = ("off", "rectangle", "linear")  # values of the parameter `segments`
COUNTS = 65536  # counts on the bus in one signal period
LARGEST_POINT = (1 << 23) - 1  # in counts on the bus
BLOCK = 12  # points in one request
PATIENCE_S = 0.5  # until a use that was requested is in force
STEEPEST = Fraction(1, 100)  # of a segment: no scale has a larger change of error in a segment
UNEQUAL = Fraction(1, 1000)  # of a segment: how far a border may lie from its nominal position
MISSING = Fraction(3, 2)  # segments: with such a distance, a border is missing
PLAIN = ("mm", "nm")  # units of plain numbers in the two columns, where the heading names none


class NotInForce(MoireError):
    """The table is in the node, but corrects nothing."""


@dataclass(frozen=True)
class SegmentTable:
    """The errors of a scale at equal distances; exact, in nm."""

    first: Fraction  # position of the first border
    length: Fraction  # of a segment
    errors: tuple[Fraction, ...]  # at the borders: shown position less the true one

    @property
    def segments(self) -> int:
        """The number of segments."""
        return len(self.errors) - 1

    def at(self, position: units.Number, use: str = "linear") -> Fraction:
        """The error in nm that is subtracted from a position in nm."""
        segment = (Fraction(position) - self.first) / self.length
        index = min(max(segment.__floor__(), 0), self.segments - 1)
        low, high = self.errors[index : index + 2]
        if not 0 <= segment < self.segments:
            return low if segment < 0 else high
        return (low + high) / 2 if use == "rectangle" else low + (high - low) * (segment - index)


@dataclass(frozen=True)
class SegmentStatus:
    """What the node does with its segment table."""

    built: int  # most segments; 0: the node has no table
    loaded: int  # points
    in_force: str  # one of USES
    reason: str  # a cause: why the requested use is not in force, or "ok"
    outside: bool  # the position is beyond the table
    error_nm: float  # subtracted now

    def words(self) -> str:
        """The status in words."""
        if not self.built:
            return f"this axis was built without a segment table ({remedy('segments')})"
        why = "" if self.reason == "ok" else f": {dict(CAUSES.values())[self.reason]}"
        if self.in_force == "off":
            return f"off{why}; {self.loaded} points loaded, at most {self.built + 1}"
        beyond = ", beyond the table" if self.outside else ""
        return (
            f"{self.in_force}{why}; {format_length(self.error_nm, 4)} taken off the position"
            f"{beyond}; {self.loaded} points loaded"
        )


def column_unit(heading: Sequence[str], column: int) -> Fraction:
    """The unit, in nm, of the plain numbers of a column.

    The heading names it, as in `position / mm` or `error (nm)`.
    """
    words = heading[column].translate(SPELLINGS) if column < len(heading) else ""
    named = [unit for unit in re.findall(r"[A-Za-z]+", words)[1:] if unit in LENGTHS]
    return LENGTHS[named[-1] if named else PLAIN[column]]


def length_of(text: str, unit: Fraction, what: str, where: str) -> Fraction:
    """A length in nm from a text with its own unit, or a plain number; raises BadFile."""
    try:
        return units.parse_length(text)
    except UnitError:
        if re.search(r"[A-Za-z]", re.sub(r"[eE][+-]?[0-9]+|nan|inf\w*", "", text)):
            raise BadFile(f"{where}: {what} is no length: {text.strip()!r}") from None
    return Fraction(str(number(text, what, where))) * unit


def read_table(path: str | Path) -> SegmentTable:
    """Reads a CSV file with two columns, position and error, and a line for each border.

    The positions rise by equal distances. Plain numbers are mm and nm unless the heading names
    other units. Raises BadFile with the line that is wrong.
    """
    path = Path(path)
    heading, found = rows(path)
    positions: list[Fraction] = []
    errors: list[Fraction] = []
    lines: list[int] = []
    for line, cells in found:
        where = f"{path}, line {line}"
        if len(cells) != 2:
            raise BadFile(f"{where}: it needs two columns, position and error, not {len(cells)}")
        position, error = (
            length_of(cell, column_unit(heading, n), what, where)
            for n, (cell, what) in enumerate(zip(cells, ("the position", "the error"), strict=True))
        )
        if positions and position == positions[-1]:
            raise BadFile(
                f"{where}: the position {format_length(position)} is there twice, also in line "
                f"{lines[-1]}"
            )
        if positions and position < positions[-1]:
            raise BadFile(
                f"{where}: the position {format_length(position)} comes after "
                f"{format_length(positions[-1])} in line {lines[-1]}: they must go up"
            )
        positions.append(position)
        errors.append(error)
        lines.append(line)
    if len(positions) < 2:
        raise BadFile(f"{path}: {len(positions)} borders are too few; 2 at least")
    check_borders(path, positions, errors, lines)
    return SegmentTable(
        positions[0], (positions[-1] - positions[0]) / (len(positions) - 1), tuple(errors)
    )


def check_borders(
    path: Path, positions: list[Fraction], errors: list[Fraction], lines: list[int]
) -> None:
    """Raises BadFile unless the borders are at equal distances and the errors are plausible."""
    usual = median_low(b - a for a, b in zip(positions, positions[1:]))
    for n in range(1, len(positions)):
        where = f"{path}, line {lines[n]}"
        if positions[n] - positions[n - 1] > MISSING * usual:
            raise BadFile(
                f"{where}: from {format_length(positions[n - 1])} to {format_length(positions[n])} "
                f"a border is missing; the others are {format_length(usual)} apart"
            )
        if abs(positions[n] - positions[0] - n * usual) > UNEQUAL * usual * n:
            raise BadFile(
                f"{where}: {format_length(positions[n])} is no border of equal segments of "
                f"{format_length(usual)} from {format_length(positions[0])} on"
            )
        if abs(errors[n] - errors[n - 1]) > STEEPEST * usual:
            raise BadFile(
                f"{where}: an error of {format_length(errors[n])} after "
                f"{format_length(errors[n - 1])} is absurd: no scale is off by "
                f"{float(STEEPEST):.0%} of a segment"
            )


def text_of(table: SegmentTable) -> str:
    """The text of a file from which read_table() makes exactly the same table."""
    positions = (table.first + n * table.length for n in range(table.segments + 1))
    lines = [
        f"{units.decimal(position / LENGTHS['mm'])}, {units.decimal(error)}"
        for position, error in zip(positions, table.errors, strict=True)
    ]
    return "\n".join(["position / mm, error / nm", *lines, ""])


def check_use(use: str) -> None:
    """Raises OutOfRange for an unknown use."""
    if use not in USES:
        raise OutOfRange(f"a segment table has no use '{use}': known are {', '.join(USES)}")


class Segments:
    """The segment table of an axis."""

    def __init__(self, axis: Axis):
        self.axis = axis

    def status(self) -> SegmentStatus:
        """What the node does with the table now."""
        reply, state = self.axis.request("segments"), self.axis.feedback("segment_state")
        error = self.axis.feedback("segment_error")["value"]
        return SegmentStatus(
            self.axis.built().sizes["segments"],
            reply["loaded"],
            USES[reply["in_force"]],
            CAUSES[reply["reason"]][0],
            bool(state["outside"]),
            self.axis.to_nm(error),
        )

    def use(self, use: str) -> SegmentStatus:
        """Sets the use to "off", "rectangle" or "linear".

        It comes into force at once if the axis is at rest; position and target then change to the
        other scale together. If not, `reason` of the returned status says why.
        """
        check_use(use)
        self.axis.set_parameter("segments", use)
        end = self.axis.transport.now() + PATIENCE_S
        while (status := self.status()).reason == "busy" and self.axis.transport.now() < end:
            self.axis.node.bus.until_next_poll(self.axis.node)
        return status

    def read_points(self) -> list[int]:
        """The loaded points, in counts on the bus."""
        loaded = self.axis.request("segments")["loaded"]
        points: list[int] = []
        while len(points) < loaded:
            points += self.axis.request("get_segments", border=len(points)).values()
        return points[:loaded]

    def write_points(self, points: list[int]) -> None:
        """Replaces the points, in counts on the bus, and reads them back; switches the table off.

        Raises NotInForce when the node does not hold what was written.
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

    def check_points(self, points: list[int]) -> None:
        """Raises OutOfRange if the node cannot hold these points."""
        most = self.axis.built().sizes["segments"]
        if not 2 <= len(points) <= most + 1:
            raise OutOfRange(
                f"{len(points)} points are too few or too many: this node's segment table takes 2 "
                f"to {most + 1}"
                if most
                else f"this axis was built without a segment table ({remedy('segments')})"
            )
        if any(abs(point) > LARGEST_POINT for point in points):
            largest = format_length(self.axis.to_nm(LARGEST_POINT), 4)
            raise OutOfRange(f"an error in the table is above {largest}: 128 periods are the most")

    def load(self, table: SegmentTable, use: str = "linear") -> SegmentStatus:
        """Replaces the table and sets its use; checks all of it before it gives up the old one."""
        axis, points = self.axis, [self.axis.to_counts(error) for error in table.errors]
        self.check_points(points)
        geometry: dict[str, units.Number] = {
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
        """The table in the node; raises NotInForce if there is none."""
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
        """The position, in nm, of the point that homing finds."""
        return self.axis.get_parameter("home_offset").value

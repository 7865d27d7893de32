# SPDX-License-Identifier: Apache-2.0
"""G-code programs whose path is known: the text for LinuxCNC, and the distance of a point from the
programmed path. Lengths in mm, in X, Y, Z.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy
from numpy.typing import NDArray

REST, STILL_MM = 40, 1e-6  # rows of a path at rest, moved less
NEAR_MM, CLOSE_MM = 0.02, 0.005  # at a place: not gone yet, and come there

# The last bit to the start is slow, so that the machine has settled when the program begins. A
# dwell would be one of the computer's time, which is not that of a simulated machine.
BEFORE_MM, SETTLING_FEED = 0.05, 20  # 0.15 s
TOUCHED = "touched.txt"  # rows of the positions of all axes
PAST_MM = 0.2  # below a surface, where a touch ends at the latest
DWELL, FIRST_LINE = "G4 P0.1", 8
PASSES = 3  # of G76 in a thread of these programs
CATCH_UP_S, SMOOTH_S = 0.05, 5e-3  # of a thread: until Z follows the spindle, and of its speed

Points = NDArray[numpy.float64]  # n rows of X, Y, Z
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Line:
    """A straight move."""

    start: Point
    end: Point
    rapid: bool = False

    def code(self) -> str:
        """The line of G-code."""
        x, y, z = self.end
        return f"{'G0' if self.rapid else 'G1'} X{x:.6f} Y{y:.6f} Z{z:.6f}"

    def distances(self, points: Points) -> Points:
        """Of each point from this move."""
        start, end = numpy.array(self.start), numpy.array(self.end)
        along = end - start
        share = numpy.clip((points - start) @ along / max(along @ along, 1e-30), 0, 1)
        found: Points = numpy.linalg.norm(points - start - share[:, None] * along, axis=1)
        return found


@dataclass(frozen=True)
class Arc:
    """A circular move in the plane of X and Y, a helix if Z changes; `turn` in radians, positive
    is counterclockwise."""

    start: Point
    centre: tuple[float, float]
    turn: float
    rise: float = 0.0

    @property
    def radius(self) -> float:
        return math.dist(self.start[:2], self.centre)

    def at(self, share: Points) -> Points:
        """Points on the way, 0 to 1."""
        first = math.atan2(self.start[1] - self.centre[1], self.start[0] - self.centre[0])
        angle = first + self.turn * share
        return numpy.stack(
            [
                self.centre[0] + self.radius * numpy.cos(angle),
                self.centre[1] + self.radius * numpy.sin(angle),
                self.start[2] + self.rise * share,
            ],
            axis=-1,
        )

    @property
    def end(self) -> Point:
        x, y, z = self.at(numpy.array([1.0]))[0]
        return float(x), float(y), float(z)

    def code(self) -> str:
        """The line of G-code."""
        x, y, z = self.end
        i, j = self.centre[0] - self.start[0], self.centre[1] - self.start[1]
        turns = math.ceil(abs(self.turn) / math.tau - 1e-9)
        word = "G3" if self.turn > 0 else "G2"
        return f"{word} X{x:.6f} Y{y:.6f} Z{z:.6f} I{i:.6f} J{j:.6f} P{max(1, turns)}"

    def distances(self, points: Points) -> Points:
        """Of each point from this move, at the angle of the point."""
        first = math.atan2(self.start[1] - self.centre[1], self.start[0] - self.centre[0])
        angle = numpy.arctan2(points[:, 1] - self.centre[1], points[:, 0] - self.centre[0])
        turned = (angle - first) * numpy.sign(self.turn) % math.tau
        best = numpy.full(len(points), numpy.inf)
        for turn in range(-1, math.ceil(abs(self.turn) / math.tau) + 1):
            share = numpy.clip((turned + turn * math.tau) / abs(self.turn), 0, 1)
            best = numpy.minimum(best, numpy.linalg.norm(points - self.at(share), axis=1))
        return best


@dataclass(frozen=True)
class Touch(Line):
    """A straight move until the touch probe touches."""

    def code(self) -> str:
        """The line of G-code."""
        return super().code().replace("G1", "G38.2")


@dataclass(frozen=True)
class Thread(Line):
    """A straight move with the spindle, `pitch` mm for each turn."""

    pitch: float = 1.0

    def code(self) -> str:
        """The line of G-code."""
        return f"{super().code().replace('G1', 'G33')} K{self.pitch:g}"


@dataclass
class Program:
    """A program from a start: each method adds a move."""

    start: Point
    feed: float  # mm/min
    mode: str = "G61"  # of the path: exact, or G64 P… with a tolerance
    setting: str = ""  # a line before the moves
    moves: list[Line | Arc] = field(default_factory=list)

    @property
    def place(self) -> Point:
        """Where it has come."""
        return self.moves[-1].end if self.moves else self.start

    def to(self, x: float, y: float, z: float, rapid: bool = False) -> "Program":
        """A straight move."""
        self.moves.append(Line(self.place, (x, y, z), rapid))
        return self

    def arc(self, x: float, y: float, turn: float, rise: float = 0.0) -> "Program":
        """A circular move around a centre."""
        self.moves.append(Arc(self.place, (x, y), turn, rise))
        return self

    def touch(self, x: float, y: float, z: float) -> "Program":
        """A straight move until the touch probe touches, before its end."""
        self.moves.append(Touch(self.place, (x, y, z)))
        return self

    def thread(self, x: float, y: float, z: float, pitch: float) -> "Program":
        """A straight move with the spindle."""
        self.moves.append(Thread(self.place, (x, y, z), pitch=pitch))
        return self

    def text(self, letters: str = "XYZ") -> str:
        """The G-code for a machine of these axes; the first move is in line FIRST_LINE."""
        x, y, z = self.start
        lines = [
            "G21 G90 G17 G91.1 G40 G49",
            "G61",
            f"G0 X{x - BEFORE_MM:.6f} Y{y:.6f} Z{z:.6f}",
            f"G1 X{x:.6f} F{SETTLING_FEED}",
            DWELL,
            self.setting,
            f"{self.mode} F{self.feed:g}",
            *(move.code() for move in self.moves),
            DWELL,
            "M2",
        ]
        missing = "".join(sorted(set("XYZ") - set(letters)))
        text = "\n".join(lines) + "\n"
        return re.sub(f" [{missing}][-.0-9]+", "", text) if missing else text

    def errors(self, path: Points, still_mm: float = STILL_MM) -> tuple[Points, Points]:
        """Distances in mm of a path from the program while it was followed, and the path after
        that; ValueError as from `followed`.
        """
        part, after = self.followed(path, still_mm)
        return numpy.min([move.distances(part) for move in self.moves], axis=0), after

    def followed(self, path: Points, still_mm: float = STILL_MM) -> tuple[Points, Points]:
        """The part of a path that followed the program, and the path after that. The path comes to
        the start, and rests at the end for REST rows at least, that is, it moves by less than
        still_mm; ValueError if it does not do so in this order.
        """
        resting = numpy.linalg.norm(path[REST:] - path[:-REST], axis=1) < still_mm
        near = first(at(path, self.start, CLOSE_MM), 0, "the start")
        moved = first(~at(path, self.start), near, "a motion")
        ended = first(resting & at(path, self.place), moved, "the end")
        began = near + int(numpy.argmin(numpy.linalg.norm(path[near:moved] - self.start, axis=1)))
        return path[began:ended], path[ended:]


def at(path: Points, place: Point, within_mm: float = NEAR_MM) -> NDArray[numpy.bool_]:
    """Where a path is at a place, without its last rows."""
    near: NDArray[numpy.bool_] = numpy.linalg.norm(path[:-REST] - place, axis=1) < within_mm
    return near


def first(found: NDArray[numpy.bool_], since: int, what: str) -> int:
    """The first row since one."""
    rows = numpy.flatnonzero(found[since:])
    if not len(rows):
        raise ValueError(f"the path does not come to {what} of the program")
    return since + int(rows[0])


def circle(centre: tuple[float, float], radius: float, z: float, feed: float) -> Program:
    """A full circle, from its leftmost point."""
    x, y = centre
    return Program((x - radius, y, z), feed).arc(x, y, -math.tau)


def both_ways(centre: tuple[float, float], radius: float, z: float, feed: float) -> Program:
    """A circle as a ball bar runs it: one and a half turns counterclockwise, and back."""
    x, y = centre
    once = Program((x - radius, y, z), feed).arc(x, y, 1.5 * math.tau)
    return once.arc(x, y, -1.5 * math.tau)


def turns_of(part: Points, centre: tuple[float, float]) -> tuple[Points, Points]:
    """The full turns, counterclockwise and clockwise, of a path that followed `both_ways`, without
    the quarters before and after each of them: rows of X, Y from the centre.
    """
    found: Points = part[:, :2] - centre
    angle = numpy.unwrap(numpy.arctan2(found[:, 1], found[:, 0]))
    angle -= angle[0]
    back = int(numpy.argmax(angle))
    within = (angle > 0.25 * math.tau) & (angle < 1.25 * math.tau)
    rows = numpy.arange(len(angle))
    return found[within & (rows < back)], found[within & (rows > back)]


def pocket(corner: tuple[float, float], size: float, step: float, z: float, feed: float) -> Program:
    """A square, cleared in lines to and fro, then its wall."""
    x, y = corner
    found = Program((x, y, z + 1), feed).to(x, y, z)
    for n in range(round(size / step) + 1):
        ends = (x, x + size) if n % 2 else (x + size, x)
        found.to(ends[1] if n == 0 else found.place[0], y + n * step, z).to(
            ends[0], y + n * step, z
        )
    for end in ((x + size, y + size), (x + size, y), (x, y), (x, y + size)):
        found.to(*end, z)
    return found


def helix(centre: tuple[float, float], radius: float, turns: int, z: float, feed: float) -> Program:
    """A thread milled downwards."""
    x, y = centre
    return Program((x + radius, y, z), feed).arc(x, y, turns * math.tau, -0.5 * turns)


def corners(start: Point, size: float, tolerance: float, feed: float) -> Program:
    """A zigzag of sharp corners, blended within a tolerance."""
    x, y, z = start
    found = Program(start, feed, f"G64 P{tolerance:g}")
    for n in range(1, 7):
        found.to(x + n * size, y + size * (n % 2), z)
    return found


@dataclass(frozen=True)
class Surface:
    """A plane that a touch probe touches from above: Z = height + slopes * (X, Y)."""

    slopes: tuple[float, float]
    height: float

    def above(self, point: Sequence[float]) -> float:
        """How far a point is above it, along Z."""
        x, y, z = point
        return z - self.height - self.slopes[0] * x - self.slopes[1] * y

    def program(self, places: Sequence[tuple[float, float]], high: float, feed: float) -> Program:
        """Touches it at places of X and Y, from Z = high; LinuxCNC writes the points to TOUCHED."""
        found = Program((*places[0], high), feed, setting=f"(PROBEOPEN {TOUCHED})")
        for x, y in places:
            low = high - self.above((x, y, high)) - PAST_MM
            found.to(x, y, high, rapid=True).touch(x, y, low).to(x, y, high, rapid=True)
        return found


def threaded(start: Point, z: float, pitch: float, turns_s: float) -> Program:
    """A thread cut with the spindle, which runs already."""
    found = Program(start, 60 * pitch * turns_s, setting=f"S{60 * turns_s:g} M3")
    return found.thread(*start[:2], z, pitch)


def passes_text(place: Point, z: float, pitch: float, turns_s: float, letters: str = "XYZ") -> str:
    """The G-code of a thread that G76 cuts in PASSES passes, in the plane of a lathe: from a place
    to z, with the spindle, which runs already."""
    begin = " ".join(f"{name}{at:g}" for name, at in zip("XYZ", place) if name in letters)
    return f"""G21 G90 G18 G40 G49 G61
S{60 * turns_s:g} M3
G0 {begin}
G76 P{pitch:g} Z{z:g} I-1 J0.2 K0.6 R1 Q0 H0 E0 L0
M5
M2
"""


def grooves_of(
    turns: Points, z: Points, pitch: float, turns_s: float, row_s: float
) -> list[Points]:
    """What is left of each pass of a thread cut downwards, in turns: the angle of the spindle
    (`turns`) and the way along Z, which undo each other in a perfect thread. Rows are `row_s`
    apart. A pass is where Z moves with the spindle, without CATCH_UP_S at its begin and its end.
    """
    smooth, edge = max(1, round(SMOOTH_S / row_s)), round(CATCH_UP_S / row_s)
    way = z / pitch
    speed = (way[smooth:] - way[:-smooth]) / (smooth * row_s)
    with_it = abs(speed + turns_s) < 0.2 * turns_s
    edges = numpy.flatnonzero(numpy.diff(numpy.r_[0, with_it, 0]))
    passes = [(begin + edge, end - edge) for begin, end in zip(edges[::2], edges[1::2])]
    return [(turns + way)[begin:end] for begin, end in passes if end - begin > edge]


def thread_errors(grooves: Sequence[Points]) -> tuple[float, float]:
    """In turns: the largest range within a pass, and the largest distance of the mean of a pass
    from that of the first one: all begin at the same angle.
    """
    within = max(float(numpy.ptp(groove)) for groove in grooves)
    starts = numpy.array([groove.mean() for groove in grooves])
    apart = (starts - starts[0] + 0.5) % 1 - 0.5
    return within, float(abs(apart).max())


def moments(path: Sequence[Sequence[float]], periods_per_mm: float) -> Points:
    """Rows of (time, positions in periods) as points in mm."""
    found: Points = numpy.array(path)[:, 1:] / periods_per_mm
    return found


SURFACE = Surface((0.37, 0.053), -8.4004)  # below where the axes home
STAGE_PROGRAMS = {  # of S0; the arc begins and ends 30 degrees from a reversal of Y
    "circle": circle((1.5, 1.5), 0.5, 0, 60),
    "arc": Program((1.25, 1.5 + 0.25 * 3**0.5, 0), 60).arc(1.5, 1.5, -math.pi / 3),
}
PROGRAMS = {
    "circle": circle((15, 10), 5, 1, 600),
    "pocket": pocket((10, 10), 3, 1, 1, 900),
    "helix": helix((12, 12), 2, 3, 4, 600),
    "corners": corners((5, 5, 2), 2, 0.05, 900),
    "surface": SURFACE.program([(24, 4), (26, 4), (25, 6)], 3, 120),
}
THREAD_MM = 0.5  # pitch
THREADS = {  # {name: text for a lathe, for the turns of its spindle in a second}
    "thread": lambda turns_s: threaded((3, 0, 5), 2, THREAD_MM, turns_s).text("XZ"),
    "passes": lambda turns_s: passes_text((6, 0, 5), 3, THREAD_MM, turns_s, "XZ"),
}
# short ones, near the zero
SHORT_PROGRAMS = {
    "small": circle((1.5, 1.5), 1, 0.5, 600),
}

# SPDX-License-Identifier: Apache-2.0
"""The indexing table of a station, which turns to absolute angles of its sensor (S4).

    table = IndexingTable(bus.node(2))
    table.turn("10deg")                 # turns, waits, returns its IndexingTableState
    table.sensor().angle

An angle is a number in arcsec, or a text with a unit such as "12.5deg".
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from moire import units
from moire.client.names import CAUSE_CODES, code_name, descriptions
from moire.client.node import Node
from moire.errors import MotionFailed, OutOfRange
from moire.made.bus_tables import CAUSES, PEER_PHASES, TURN_PHASES

TURN = 360 * 3600  # arcsec
COUNTS = 100  # counts on the bus in one arcsec
MOST_STATIONS = 360


@dataclass(frozen=True)
class IndexingTableState:
    """Where the table is, and how its last turn ended. Angles are in arcsec."""

    phase: str
    ended: str  # cause that ended the last turn
    tries: int
    overshoots: int
    target: Fraction
    reading: Fraction  # the last angle that was read at rest
    left: Fraction  # distance from the reading to the target

    @property
    def words(self) -> str:
        """The phase in words."""
        return descriptions(TURN_PHASES, [self.phase])

    @property
    def ended_words(self) -> str:
        """How the last turn ended, in words."""
        return descriptions(CAUSES, [self.ended])


Progress = Callable[[IndexingTableState], object]


@dataclass(frozen=True)
class SensorState:
    """What the angle sensor has sent."""

    angle: Fraction  # arcsec, in the last good frame
    age_s: Fraction  # of that frame
    dead: bool  # no good frame came for too long
    frames: int  # good ones since power-up
    wrong_crc: int
    broken: int
    missed: int  # frames whose numbers were skipped


@dataclass(frozen=True)
class PeerState:
    """The connection between the main node and the sub-node of a station."""

    phase: str
    ended: str
    station: int  # from 0 on
    stations: int  # in the station list, which a sub-node in legacy mode counts itself
    next: int  # station of the next order, from 0 on
    heard: int  # orders or frames received
    garbage: int  # bytes or frames that were not understood
    repeated: int  # requests answered once more

    @property
    def words(self) -> str:
        """The phase in words."""
        return descriptions(PEER_PHASES, [self.phase])

    @property
    def ended_words(self) -> str:
        """How the last order ended, in words."""
        return descriptions(CAUSES, [self.ended])


def angle_counts(angle: units.Value) -> int:
    """The counts on the bus of an angle; raises UnitError, or OutOfRange outside one turn."""
    exact = units.parse_angle(angle)
    counts = round(exact * COUNTS)
    if not 0 <= counts < TURN * COUNTS:
        raise OutOfRange(f"an angle is 0deg or more and below 360deg, not {angle_text(exact)}")
    return counts


def arcsec(counts: int) -> Fraction:
    """The angle in arcsec of so many counts."""
    return Fraction(counts, COUNTS)


def angle_text(angle: Fraction) -> str:
    """An angle in arcsec as text."""
    return units.with_unit(units.ANGLE, angle, 9)


class IndexingTable:
    """The indexing table of a node."""

    def __init__(self, node: Node):
        self.node = node

    def state(self) -> IndexingTableState:
        """Phase, target and reading of the table."""
        reply = self.node.request("turn_state")
        return IndexingTableState(
            code_name(TURN_PHASES, reply["phase"], "phase"),
            code_name(CAUSES, reply["ended"], "cause"),
            reply["tries"],
            reply["overshoots"],
            *(arcsec(reply[name]) for name in ("target", "reading", "left")),
        )

    def sensor(self) -> SensorState:
        """What the angle sensor has sent."""
        reply = self.node.request("sensor")
        return SensorState(
            arcsec(reply["angle"]),
            Fraction(reply["age"], self.node.identity.clk_hz),
            bool(reply["timed_out"]),
            *(reply[name] for name in ("frames", "wrong_crc", "broken", "missed")),
        )

    def begin(self, angle: units.Value) -> None:
        """Begins to turn, and returns at once. A drive that is off is switched on."""
        self.node.request("turn_to", angle=angle_counts(angle))

    def turn(self, angle: units.Value, progress: Progress | None = None) -> IndexingTableState:
        """Turns to an angle and waits; raises MotionFailed with the reason if it is not reached.

        Whatever interrupts the wait stops the table.
        """
        self.begin(angle)
        try:
            state = self.wait(progress)
        except BaseException:
            self.stop()
            raise
        if state.ended != "ok":
            raise MotionFailed(
                state.ended,
                CAUSE_CODES[state.ended],
                f"the table of node {self.node.address} is not at {angle_text(state.target)}: "
                f"{state.ended_words}",
            )
        return state

    def wait(self, progress: Progress | None = None) -> IndexingTableState:
        """Waits until the table is at rest."""
        while (state := self.state()).phase != "idle":
            if progress:
                progress(state)
            self.node.bus.until_next_poll(self.node)
        return state

    def stop(self) -> None:
        """Stops the table."""
        self.node.request("stop", axis=0)

    def peer(self) -> PeerState:
        """The connection to the other node of the station."""
        reply = self.node.request("peer")
        return PeerState(
            phase=code_name(PEER_PHASES, reply.pop("phase"), "phase"),
            ended=code_name(CAUSES, reply.pop("ended"), "cause"),
            **reply,
        )

    def next_station(self, number: int) -> None:
        """Sets the station of the next order, from 0 on, in a sub-node in legacy mode."""
        self.node.request("peer_next", station=number)

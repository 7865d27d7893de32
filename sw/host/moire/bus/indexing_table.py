# SPDX-License-Identifier: Apache-2.0
"""The table of a station: turned to absolute angles of its sensor (S4). Angles in arcsec, or texts
such as "12.5deg".

table = IndexingTable(bus.node(2))
table.turn("10deg")                                    turns, waits, returns its IndexingTableState
table.sensor().angle
table.next_station(0)                                   of the program of a sub-node in mode
                                                        printed: see moire.job
"""

from dataclasses import dataclass
from fractions import Fraction

from moire import units
from moire.bus.client import CAUSE_CODES, named, words
from moire.errors import MotionFailed, OutOfRange
from moire.made.bus_tables import CAUSES, PEER_PHASES, TURN_PHASES

TURN = 360 * 3600  # arcsec
COUNTS = 100  # of the wire in an arcsec
MOST_STATIONS = 360


@dataclass(frozen=True)
class IndexingTableState:
    phase: str
    ended: str  # cause of the last index
    tries: int
    overshoots: int
    target: Fraction  # arcsec, as the next two
    reading: Fraction  # last angle read at rest
    left: Fraction  # to the target

    @property
    def words(self) -> str:
        return words(TURN_PHASES, [self.phase])

    @property
    def ended_words(self) -> str:
        return words(CAUSES, [self.ended])


@dataclass(frozen=True)
class SensorState:
    angle: Fraction  # arcsec, of the last good frame
    age_s: Fraction  # of it
    dead: bool
    frames: int  # good ones since power-up
    wrong_crc: int
    broken: int
    missed: int  # by the gaps of their numbers


@dataclass(frozen=True)
class PeerState:
    phase: str
    ended: str
    station: int  # from 0 on
    stations: int  # of its program, which a sub-node in mode printed counts
    next: int  # to which its next order goes, from 0 on
    heard: int  # orders or frames
    garbage: int  # bytes or frames not understood
    repeated: int  # requests answered again

    @property
    def words(self) -> str:
        return words(PEER_PHASES, [self.phase])

    @property
    def ended_words(self) -> str:
        return words(CAUSES, [self.ended])


def angle_counts(angle) -> int:
    """What the wire carries for an angle in arcsec or with a unit."""
    wanted = units.parse_angle(angle)
    counts = round(wanted * COUNTS)
    if not 0 <= counts < TURN * COUNTS:
        raise OutOfRange(
            f"an angle is 0deg or more and below 360deg, not {units.with_unit(units.ANGLE, wanted, 9)}"
        )
    return counts


def arcsec(counts: int) -> Fraction:
    return Fraction(counts, COUNTS)


class IndexingTable:
    def __init__(self, node):
        self.node = node

    def state(self) -> IndexingTableState:
        told = self.node.request("turn_state")
        return IndexingTableState(
            named(TURN_PHASES, told["phase"], "phase"),
            named(CAUSES, told["ended"], "cause"),
            told["tries"],
            told["overshoots"],
            *(arcsec(told[name]) for name in ("target", "reading", "left")),
        )

    def sensor(self) -> SensorState:
        told = self.node.request("sensor")
        return SensorState(
            arcsec(told["angle"]),
            Fraction(told["age"], self.node.identity.clk_hz),
            bool(told["timed_out"]),
            *(told[name] for name in ("frames", "wrong_crc", "broken", "missed")),
        )

    def begin(self, angle):
        """Returns at once. A drive that is off is switched on."""
        self.node.request("turn_to", angle=angle_counts(angle))

    def turn(self, angle, progress=None) -> IndexingTableState:
        """Turns to an angle and waits; MotionFailed says why it did not get there. Whatever
        interrupts the wait stops the table.
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
                f"the table of node {self.node.address} is not at "
                f"{units.with_unit(units.ANGLE, state.target, 9)}: {state.ended_words}",
            )
        return state

    def wait(self, progress=None) -> IndexingTableState:
        while (state := self.state()).phase != "idle":
            if progress:
                progress(state)
            self.node.bus.transport.wait(self.node.bus.poll_s)
        return state

    def stop(self):
        self.node.request("stop", axis=0)

    def peer(self) -> PeerState:
        told = self.node.request("peer")
        return PeerState(
            **{
                **told,
                "phase": named(PEER_PHASES, told["phase"], "phase"),
                "ended": named(CAUSES, told["ended"], "cause"),
            }
        )

    def next_station(self, number: int):
        """Of the program of a sub-node in mode printed, to which its next order goes, from 0 on."""
        self.node.request("peer_next", station=number)

# SPDX-License-Identifier: Apache-2.0
"""The job of a main node: a list of stations, which are cut one after the other (S4).

    job = Job(bus.node(1))
    job.load(["0deg", "10deg", "20deg"])    # or read_stations("former.csv"), or equal_parts(36)
    job.start()
    state = job.wait()                      # until it is done, or a person has to answer
    if "again" in state.answers:
        job.do("again")

An angle is a number in arcsec, or a text with a unit such as "12.5deg".
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from moire import units
from moire.client.indexing_table import (
    COUNTS,
    MOST_STATIONS,
    TURN,
    angle_counts,
    angle_text,
    arcsec,
)
from moire.client.names import CAUSE_CODES, bit_names, code_name, descriptions
from moire.client.node import Node
from moire.client.nonvolatile import cause_of, when_written
from moire.errors import BadFile, MoireError, MotionFailed, OutOfRange
from moire.made.bus_tables import CAUSES, FAULTS, JOB_ACTIONS, JOB_FLAGS, JOB_STATES

ACTIONS = {name: code for code, (name, _) in JOB_ACTIONS.items()}
AT_REST = ("idle", "finished", "paused", "unsure")
DECIMAL_COMMA = re.compile(r'"?[+-]?\d+,\d')  # or a comma that separates two numbers
SAVE_S = 30  # a list of 360 stations needs less than one second on the bus


@dataclass(frozen=True)
class JobState:
    """How far the job is, and which answers it accepts."""

    state: str
    cause: str  # why it waits, or did not continue
    station: int  # from 0 on
    stations: int
    answers: tuple[str, ...]  # the actions that it accepts now
    flags: tuple[str, ...]
    table_faults: tuple[str, ...] = ()  # of the sub-node, where that is the cause

    @property
    def words(self) -> str:
        """The state in words, with the number of the station."""
        state = descriptions(JOB_STATES, [self.state])
        if not self.stations:
            return state
        return f"{state}, station {min(self.station + 1, self.stations)} of {self.stations}"

    @property
    def cause_words(self) -> str:
        """The cause in words, with the faults of the table."""
        cause = descriptions(CAUSES, [self.cause])
        if not self.table_faults:
            return cause
        return f"{cause} ({descriptions(FAULTS, self.table_faults)})"

    @property
    def flag_words(self) -> str:
        """The flags in words."""
        return descriptions(JOB_FLAGS, self.flags)


@dataclass(frozen=True)
class StationList:
    """The station list in the EEPROM of a node."""

    generation: int  # rises by one with every save; 0: there is no list
    angles: tuple[Fraction, ...]  # arcsec
    cause: str  # why there is none
    journal: int  # lines written so far


def checked(angles: Iterable[units.Value]) -> list[int]:
    """The counts of a station list; raises OutOfRange with the number of a wrong station."""
    angles = list(angles)
    if not 1 <= len(angles) <= MOST_STATIONS:
        raise OutOfRange(f"a station list has 1 to {MOST_STATIONS} stations, not {len(angles)}")
    counts: list[int] = []
    for number, angle in enumerate(angles, 1):
        try:
            counts.append(angle_counts(angle))
        except MoireError as error:
            raise OutOfRange(f"station {number}: {error}") from None
        if number > 1 and counts[-1] <= counts[-2]:
            raise OutOfRange(
                f"station {number} at {angle_text(arcsec(counts[-1]))} does not lie above the "
                "one before it"
            )
    return counts


def equal_parts(count: int) -> list[Fraction]:
    """Stations in arcsec that divide a turn equally, each at the nearest count on the bus."""
    if not 1 <= count <= MOST_STATIONS:
        raise OutOfRange(f"a turn is divided into 1 to {MOST_STATIONS} stations, not {count}")
    return [arcsec((n * TURN * COUNTS + count // 2) // count) for n in range(count)]


def read_stations(path: str | Path) -> list[Fraction]:
    """Stations in arcsec from the first column of a CSV file; raises BadFile.

    An angle has a unit or is in degrees. A # begins a comment, and the first line may be a heading,
    which has no digit in its first column. In a line with a semicolon only semicolons separate. An
    angle that may have a decimal comma is refused.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise BadFile(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadFile(f"{path} is no text") from None
    angles: list[Fraction] = []
    heading = False
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        cell = text.partition(";" if ";" in text else ",")[0].strip().strip('"')
        if not cell:
            continue
        if DECIMAL_COMMA.match(text):
            raise BadFile(
                f"{path}, line {number}: '{text}' may begin with a decimal comma: write a decimal "
                "point, or a space after a comma that separates"
            )
        try:
            angles.append(Fraction(cell) * 3600 if is_number(cell) else units.parse_angle(cell))
        except MoireError as error:
            if angles or heading or any(map(str.isdigit, cell)):
                raise BadFile(f"{path}, line {number}: {error}") from None
            heading = True
    if not angles:
        raise BadFile(
            f"{path} has no stations: it needs a line for each, with its angle in degrees"
        )
    return angles


def is_number(text: str) -> bool:
    """Whether a text is a plain number, without a unit."""
    try:
        Fraction(text)
    except (ValueError, ZeroDivisionError):
        return False
    return "/" not in text


class Job:
    """The job of a main node."""

    def __init__(self, node: Node):
        self.node = node

    def state(self) -> JobState:
        """State, station and possible answers."""
        reply = self.node.request("job")
        answers = tuple(name for name, code in ACTIONS.items() if reply["answers"] >> code & 1)
        return JobState(
            code_name(JOB_STATES, reply["state"], "state"),
            code_name(CAUSES, reply["cause"], "cause"),
            reply["station"],
            reply["stations"],
            answers,
            bit_names(JOB_FLAGS, reply["flags"]),
            bit_names(FAULTS, reply["table_faults"]),
        )

    def do(self, action: str) -> None:
        """Does "start", "pause", "resume", "stop", "again" or "next"; raises Refused."""
        self.node.request("job_do", action=ACTIONS[action])

    def start(self) -> None:
        """Begins with the first station; raises Refused."""
        self.do("start")

    def wait(self, progress: Callable[[JobState], object] | None = None) -> JobState:
        """Waits until the job is done, or needs an answer of a person."""
        while (state := self.state()).state not in AT_REST:
            if progress:
                progress(state)
            self.node.bus.until_next_poll(self.node)
        return state

    def load(self, angles: Iterable[units.Value]) -> StationList:
        """Writes a station list, and the settings of the node with it, into the EEPROM.

        Raises OutOfRange for a wrong list, and MotionFailed with the reason when it is not saved.
        """
        counts = checked(angles)
        self.ready()
        self.node.request("job_begin")
        for station, count in enumerate(counts):
            self.node.request("job_add", station=station, angle=count)
        self.node.request("job_save")
        ended = self.ready()
        if ended != "ok":
            raise MotionFailed(
                ended,
                CAUSE_CODES[ended],
                f"node {self.node.address} did not save the station list: "
                f"{descriptions(CAUSES, [ended])}",
            )
        return self.read()

    def ready(self) -> str:
        """Waits until the EEPROM is not being read or written; returns how that ended."""
        return self._stored()[0]

    def _stored(self) -> tuple[str, dict[str, int]]:
        """How the work of the EEPROM ended, and what the node reports of the list there."""
        reply = when_written(self.node, "job_stations", SAVE_S)
        return cause_of(reply["writing"], reply["ended"]), reply

    def read(self) -> StationList:
        """The station list in the EEPROM."""
        cause, reply = self._stored()
        angles = tuple(
            arcsec(self.node.request("job_angle", station=station)["angle"])
            for station in range(reply["stations"])
        )
        return StationList(reply["generation"], angles, cause, reply["journal"])

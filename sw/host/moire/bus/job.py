# SPDX-License-Identifier: Apache-2.0
"""The job of a main node: its program of stations, cut one after the other (S4). Angles in arcsec,
or texts such as "12.5deg".

job = Job(bus.node(1))
job.load(["0deg", "10deg", "20deg"])         or read_stations("former.csv"), or equal_parts(36)
job.start()
state = job.wait()                           until it is done, or a person has to answer
if "again" in state.answers: job.do("again")
"""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from moire import units
from moire.bus.client import CAUSE_CODES, bits, named, words
from moire.bus.indexing_table import COUNTS, MOST_STATIONS, TURN, angle_counts, arcsec
from moire.errors import BadFile, MoireError, MotionFailed, OutOfRange
from moire.made.bus_tables import CAUSES, FAULTS, JOB_ACTIONS, JOB_FLAGS, JOB_STATES

ACTIONS = {name: code for code, (name, _) in JOB_ACTIONS.items()}
AT_REST = ("idle", "finished", "paused", "unsure")
SAVE_S = 30  # a program of 360 stations takes less than one second on the bus


@dataclass(frozen=True)
class JobState:
    state: str
    cause: str  # why it waits, or did not go on
    station: int  # from 0 on
    stations: int
    answers: tuple  # actions that it takes now
    flags: tuple
    table_faults: tuple = ()  # of the sub-node, where that is the cause

    @property
    def words(self) -> str:
        place = (
            f", station {min(self.station + 1, self.stations)} of {self.stations}"
            if self.stations
            else ""
        )
        return words(JOB_STATES, [self.state]) + place

    @property
    def cause_words(self) -> str:
        return words(CAUSES, [self.cause]) + f" ({words(FAULTS, self.table_faults)})" * bool(
            self.table_faults
        )

    @property
    def flag_words(self) -> str:
        return words(JOB_FLAGS, self.flags)


@dataclass(frozen=True)
class StationList:
    generation: int  # each saved one has one more; 0: there is none
    angles: tuple  # arcsec
    cause: str  # why there is none
    journal: int  # lines written so far


def checked(angles) -> list:
    """Counts of the wire; OutOfRange names the station."""
    angles = list(angles)
    if not 1 <= len(angles) <= MOST_STATIONS:
        raise OutOfRange(f"a program has 1 to {MOST_STATIONS} stations, not {len(angles)}")
    counts = []
    for number, angle in enumerate(angles, 1):
        try:
            counts.append(angle_counts(angle))
        except MoireError as error:
            raise OutOfRange(f"station {number}: {error}") from None
        if number > 1 and counts[-1] <= counts[-2]:
            raise OutOfRange(
                f"station {number} at {said(arcsec(counts[-1]))} does not lie above the one before it"
            )
    return counts


def said(angle) -> str:
    return units.with_unit(units.ANGLE, angle, 9)


def equal_parts(count: int) -> list:
    """Stations that divide a turn, each at the nearest count of the wire."""
    if not 1 <= count <= MOST_STATIONS:
        raise OutOfRange(f"a turn is divided into 1 to {MOST_STATIONS} stations, not {count}")
    return [arcsec((n * TURN * COUNTS + count // 2) // count) for n in range(count)]


def read_stations(path) -> list:
    """From a CSV file: the first column, with a unit or in degrees; # begins a remark, and the
    first line may be a title.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise BadFile(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadFile(f"{path} is no text") from None
    angles, titled = [], False
    for number, line in enumerate(lines, 1):
        cell = line.partition("#")[0].replace(";", ",").partition(",")[0].strip().strip('"')
        if not cell:
            continue
        try:
            angles.append(Fraction(cell) * 3600 if is_number(cell) else units.parse_angle(cell))
        except MoireError as error:
            if angles or titled:
                raise BadFile(f"{path}, line {number}: {error}") from None
            titled = True
    if not angles:
        raise BadFile(
            f"{path} has no stations: a line for each is wanted, with its angle in degrees"
        )
    return angles


def is_number(text: str) -> bool:
    try:
        Fraction(text)
    except (ValueError, ZeroDivisionError):
        return False
    return "/" not in text


class Job:
    def __init__(self, node):
        self.node = node

    def state(self) -> JobState:
        told = self.node.request("job")
        answers = tuple(name for name, code in ACTIONS.items() if told["answers"] >> code & 1)
        return JobState(
            named(JOB_STATES, told["state"], "state"),
            named(CAUSES, told["cause"], "cause"),
            told["station"],
            told["stations"],
            answers,
            bits(JOB_FLAGS, told["flags"]),
            bits(FAULTS, told["table_faults"]),
        )

    def do(self, action: str):
        """start, pause, resume, stop, again or next; Refused says why not."""
        self.node.request("job_do", action=ACTIONS[action])

    def start(self):
        self.do("start")

    def wait(self, progress=None) -> JobState:
        """Until it is done, or waits for a person."""
        while (state := self.state()).state not in AT_REST:
            if progress:
                progress(state)
            self.node.bus.transport.wait(self.node.bus.poll_s)
        return state

    def load(self, angles) -> StationList:
        """Writes a program, and the settings of the node with it, into the EEPROM; MotionFailed
        says why it is not kept.
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
                f"node {self.node.address} did not keep the program: {words(CAUSES, [ended])}",
            )
        return self.read()

    def ready(self) -> str:
        """Waits until the EEPROM is not being read or written; how that ended."""
        transport = self.node.bus.transport
        begun = transport.now()
        while (told := self.node.request("job_stations"))[
            "writing"
        ] and transport.now() - begun < SAVE_S:
            transport.wait(self.node.bus.poll_s)
        return "eeprom_busy" if told["writing"] else named(CAUSES, told["ended"], "cause")

    def read(self) -> StationList:
        cause = self.ready()
        told = self.node.request("job_stations")
        angles = tuple(
            arcsec(self.node.request("job_angle", station=station)["angle"])
            for station in range(told["stations"])
        )
        return StationList(told["generation"], angles, cause, told["journal"])

# SPDX-License-Identifier: Apache-2.0
"""What the methods of Bus, Node and Axis return. A unit is part of each field's name or comment."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any, NamedTuple, TypedDict

from moire.bus.protocol import IN_MOTION
from moire.client.names import descriptions
from moire.errors import WrongBuild
from moire.made.bus_tables import (
    CALIBRATION_REASONS,
    CAUSES,
    ENCODER_EVENTS,
    FAULTS,
    PROTOCOL_CRC,
    SIGNAL_FAULTS,
    STATES,
)
from moire.made.registers import MAP_CRC


@dataclass(frozen=True)
class Identity:
    """Which build a node is, and its clocks."""

    address: int
    map_crc: int
    protocol_crc: int
    version: int
    axes: int
    clk_hz: int  # system clock
    tick_hz: int  # servo loop
    sample_hz: int  # ADC

    def check(self) -> None:
        """Raises WrongBuild unless node and host were made from the same tables."""
        if self.protocol_crc != PROTOCOL_CRC:
            raise WrongBuild(
                self.address, "protocol table (bus.toml)", self.protocol_crc, PROTOCOL_CRC
            )
        if self.map_crc != MAP_CRC:
            raise WrongBuild(self.address, "register map (registers.rdl)", self.map_crc, MAP_CRC)

    @property
    def matches(self) -> bool:
        """Whether node and host were made from the same tables."""
        return (self.protocol_crc, self.map_crc) == (PROTOCOL_CRC, MAP_CRC)


@dataclass(frozen=True)
class Status:
    """The state of an axis at one moment. Faults, events and causes are names of bus.toml."""

    state: str
    ended: str  # cause that ended the last motion, "running" during a motion
    enabled: bool
    homed: bool
    limit_low: bool
    limit_high: bool
    estop: bool
    settled: bool  # the error stayed inside the settling window for the settling time
    saturated: bool
    faults: tuple[str, ...]
    first_fault: tuple[str, ...]
    encoder_events: tuple[str, ...]
    position_nm: float
    target_nm: float
    velocity_mm_s: float
    drive_command: float  # of full scale, -1 to 1
    counts: int  # position in counts of the incremental encoder

    @property
    def words(self) -> str:
        """The state in words."""
        return descriptions(STATES, [self.state])

    @property
    def fault_words(self) -> str:
        """The present faults in words, empty without one."""
        return descriptions(FAULTS, self.faults)

    @property
    def first_fault_words(self) -> str:
        """The fault that came first, in words."""
        return descriptions(FAULTS, self.first_fault)

    @property
    def encoder_event_words(self) -> str:
        """The events of the encoder in words, empty without one."""
        return descriptions(ENCODER_EVENTS, self.encoder_events)

    @property
    def ended_words(self) -> str:
        """How the last motion ended, in words."""
        return descriptions(CAUSES, [self.ended])

    @property
    def in_motion(self) -> bool:
        """Whether a motion or a stop is under way."""
        return self.state in IN_MOTION

    def values(self) -> dict[str, Any]:
        """All fields for JSON, with the words for state, faults and the last motion."""
        return {
            **asdict(self),
            "words": self.words,
            "fault_words": self.fault_words,
            "ended_words": self.ended_words,
        }


class Sample(NamedTuple):
    """The status of an axis, and the time of its bus at which it was read, s."""

    time_s: float
    status: Status


Progress = Callable[[Status], object]  # called with a Status from time to time during a motion


@dataclass(frozen=True)
class Encoder:
    """The raw signals of the encoder, and what homing found."""

    sin: int  # ADC counts
    cos: int  # ADC counts
    phase: float  # of a period, 0 to 1
    amplitude: int  # ADC counts
    quadrature_count: int
    rejected_pulses: int
    rejected_samples: int
    home_phase_nm: float  # from where homing arrived to the phase zero that it took
    home_margin: float  # 1: homing arrived exactly on the phase zero, 0: midway between two
    fault_position_nm: float


@dataclass(frozen=True)
class Drive:
    """The output of an axis."""

    kind: str  # where the command goes: bridge, steps or dac
    built: tuple[str, ...]  # the outputs that this node has; "fine" is the fine stage
    command: float  # of full scale, -1 to 1
    steps: int  # sent since reset
    fine_command: float  # of full scale, -1 to 1
    override: Fraction  # speed at which profiles are played, of full speed; 0: paused


@dataclass(frozen=True)
class CalibrationState:
    """The progress of the sine/cosine auto-calibration."""

    reason: str  # "calibrating", or the reason why the calibration refuses at present
    settled: bool  # offset, gain, quadrature error and harmonics are all known
    frozen: bool
    accepted: int  # measurements used since power-up
    refused: int  # measurements that were not good enough
    scatter_nm: float  # standard error of the last measurement

    @property
    def words(self) -> str:
        """The reason in words."""
        return descriptions(CALIBRATION_REASONS, [self.reason])


class Correction(TypedDict):
    """The correction of sine and cosine, in counts on the bus."""

    sin_offset: int
    cos_offset: int
    gain: int
    quadrature_error: int
    cosine: list[int]  # harmonics, by order from 1
    sine: list[int]


@dataclass(frozen=True)
class Signal:
    """What is wrong with sine and cosine; the names are those of SIGNAL_FAULTS."""

    faults: tuple[str, ...]  # present now
    first: tuple[str, ...]  # the ones that came first since reset()

    @property
    def fault_words(self) -> str:
        """The present faults in words, empty without one."""
        return descriptions(SIGNAL_FAULTS, self.faults)

    @property
    def first_words(self) -> str:
        """The faults that came first, in words."""
        return descriptions(SIGNAL_FAULTS, self.first)


@dataclass(frozen=True)
class Capture:
    """One captured position."""

    sources: tuple[str, ...]  # names of CAPTURE_SOURCES, several if they came at once
    position_nm: float  # of the last sample before the event
    time_clk: int  # time of the event in cycles, wraps at 2^32
    age_s: float  # time from that sample to the event; the longest that is counted, or longer


@dataclass(frozen=True)
class IndexSurvey:
    """How an index lies between the edges of A and B, and its gate. See Axis.survey_index()."""

    gate: str  # of the parameter index_gate
    margin_nm: float  # by which the index may move until another count is found
    least_margin_nm: float  # for what was not seen: a share of a count, and the scatter
    width_nm: float  # of the index
    scatter_nm: float  # range in which an edge of the index was met
    passes: int  # over each of its two edges
    warnings: tuple[str, ...]  # "index_on_edge": no gate has the least margin
    shift_nm: float | None  # of the index, that ends the warning; None: no warning, or none helps

    @property
    def warning_words(self) -> str:
        """What the warning means, and what to do about it; empty without one."""
        if not self.warnings:
            return ""
        remedy = (
            "no shift helps: its edges scatter too much for its width, use a cleaner signal"
            if self.shift_nm is None
            else f"shift the index or the reading head by {self.shift_nm / 1000:+.2f} um"
        )
        return (
            "the index lies on an edge of A or B for every gate, so that a search may find another "
            f"count: {remedy}, and survey it again"
        )


@dataclass(frozen=True)
class Compare:
    """The state of position compare."""

    armed: bool
    passed: int  # points passed since it was armed
    late: bool  # a pulse had to wait until the previous one was over

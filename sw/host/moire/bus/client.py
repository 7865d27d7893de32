# SPDX-License-Identifier: Apache-2.0
"""Nodes and axes as a program sees them: real units, words, and exceptions that say what to do.

    with SerialBus("/dev/ttyUSB0") as port:
        axis = Bus(port).axis(address=1)
        axis.enable()
        axis.home()
        print(axis.move(mm=1.5).position_nm)
        axis.disable()

A drive stays on only while somebody talks on the line: the node's watchdog switches it off after
`watchdog_time`.
"""

import random
import re
from dataclasses import dataclass, field
from fractions import Fraction

from moire import units
from moire.bus.protocol import ADDRESSES, Exchange, Timing, request_body, sync_words
from moire.bus.transport import BAUD, Transport
from moire.errors import (
    BusError,
    BusGarbled,
    MoireError,
    MotionFailed,
    NoAnswer,
    NotCalibrated,
    OutOfRange,
    PortError,
    Refused,
    UnknownName,
    WrongBuild,
)
from moire.made.bus_tables import (
    CALIBRATION_ACTIONS,
    CALIBRATION_REASONS,
    CAUSES,
    ENCODER_EVENTS,
    FAULTS,
    FLAGS,
    PARAMETERS,
    PROTOCOL_CRC,
    SIGNAL_FAULTS,
    STATES,
)
from moire.made.registers import FIELDS, MAP_CRC

COUNTS = 65536  # of the wire, in one signal period
FULL_SCALE = 32768  # of the command
SYNC_S = 0.002  # after it, firmware too knows what the mark began
BAUD_CHANGE_S = 0.005  # a node changes when the reply is out, and no more than this later
RATES = (
    BAUD,
    1_000_000,
    500_000,
    250_000,
    3_000_000,
    2_000_000,
    921_600,
    460_800,
    230_400,
    57_600,
    38_400,
    19_200,
    9_600,
)
POLL_S = 0.05  # between two looks at a motion, where a Bus is not told otherwise

HARMONICS = 10  # orders of phase error that are corrected
SCATTER = 1 << 20  # of learner.scatter, in one signal period
CORRECTION = ("sin_offset", "cos_offset", "gain", "quadrature_error")
CALIBRATION_SPEEDS = (
    Fraction(1),
    Fraction(3, 5),
    Fraction(4, 5),
)  # shares of the top speed; the learner wants several
CALIBRATION_SAMPLES = 20  # for one period at the top speed of learning; it wants eight
CALIBRATION_STROKE_S = 0.5  # for one way at the top speed: most of it is then at an even speed
CAPTURE_SOURCES = (
    "index",
    "tick",
    "software",
    "probe_0_rising",
    "probe_1_rising",
    "probe_0_falling",
    "probe_1_falling",
)

FILTERS = 2  # of the servo
FILTER = ("b0", "b1", "b2", "a1", "a2")

# words for the values of a parameter or setting that is a choice, from 0 on
CHOICES = {
    "home_end": ("low", "high"),
    "auto_calibration": ("frozen", "learns"),
    "decoder_mode": ("every_edge", "every_second", "every_fourth", "pulses"),
    "position_source": ("phases", "counts", "own_steps"),
    "drive": ("bridge", "steps", "dac"),
    "step_output": ("step_and_direction", "quadrature", "pulses"),
    "step_invert": ("none", "step", "direction", "both"),
    "filters": ("none", "first", "second", "both"),
    "segments": ("off", "rectangle", "linear"),
    "turn_direction": ("direct", "shorter", "up"),
    "peer_mode": ("off", "printed", "frames"),
    "peer_role": ("main", "sub"),
}
HOME_METHODS = {"s0": -1, "s3": -2}  # beside the numbers of CiA 402

CAUSE_CODES = {name: code for code, (name, _) in CAUSES.items()}

# unit in bus.toml: what people write; its worth there, the period taken as one nm; whether a period
# is in it
KINDS = {
    "pm": (units.LENGTH, Fraction(1, 1000), False),
    "period": (units.LENGTH, Fraction(1), True),
    "period/s": (units.SPEED, Fraction(1, 10**6), True),
    "period/s2": (units.ACCELERATION, Fraction(1, 10**6), True),
    "period/s3": (units.JERK, Fraction(1, 10**6), True),
    "s": (units.TIME, Fraction(1), False),
    "Hz": (units.FREQUENCY, Fraction(1), False),
    "arcsec": (units.ANGLE, Fraction(1), False),
    "": (units.NUMBER, Fraction(1), False),
}


def bits(table: dict, value: int) -> tuple:
    """Names of the bits that are set; a bit without a name is named by its number."""
    return tuple(
        table[bit][0] if bit in table else f"bit {bit}"
        for bit in range(value.bit_length())
        if value >> bit & 1
    )


def words(table: dict, names) -> str:
    said = dict(table.values())
    return ", ".join(said.get(name, name) for name in names)


def named(table: dict, code: int, what: str) -> str:
    return table[code][0] if code in table else f"{what} {code}"


# ------------------------------------------------------------------ what the node tells


@dataclass(frozen=True)
class Identity:
    address: int
    map_crc: int
    protocol_crc: int
    version: int
    axes: int
    clk_hz: int
    tick_hz: int
    sample_hz: int

    def check(self):
        """Raises WrongBuild unless node and host were made from the same tables."""
        if self.protocol_crc != PROTOCOL_CRC:
            raise WrongBuild(
                self.address, "protocol table (bus.toml)", self.protocol_crc, PROTOCOL_CRC
            )
        if self.map_crc != MAP_CRC:
            raise WrongBuild(self.address, "register map (registers.rdl)", self.map_crc, MAP_CRC)

    @property
    def matches(self) -> bool:
        return (self.protocol_crc, self.map_crc) == (PROTOCOL_CRC, MAP_CRC)


@dataclass(frozen=True)
class Status:
    state: str
    ended: str  # cause of the last motion
    enabled: bool
    homed: bool
    limit_low: bool
    limit_high: bool
    estop: bool
    settled: bool
    saturated: bool
    faults: tuple
    first_fault: tuple
    encoder_events: tuple
    position_nm: float
    target_nm: float
    velocity_mm_s: float
    drive_command: float  # of full scale, -1…1
    counts: int  # position in counts of the read-out

    @property
    def words(self) -> str:
        return words(STATES, [self.state])

    @property
    def fault_words(self) -> str:
        return words(FAULTS, self.faults)

    @property
    def first_fault_words(self) -> str:
        return words(FAULTS, self.first_fault)

    @property
    def encoder_event_words(self) -> str:
        return words(ENCODER_EVENTS, self.encoder_events)

    @property
    def ended_words(self) -> str:
        return words(CAUSES, [self.ended])

    @property
    def in_motion(self) -> bool:
        return self.state in ("homing", "moving", "settling", "stopping")


@dataclass(frozen=True)
class Encoder:
    sin: int
    cos: int
    phase: float  # of a period
    amplitude: int  # converter counts
    quadrature_count: int
    rejected_pulses: int
    rejected_samples: int
    home_phase_nm: float  # from where homing arrived to the phase zero that it took
    home_margin: float  # 1: arrived right on the phase zero, 0: midway between two
    fault_position_nm: float


@dataclass(frozen=True)
class Drive:
    kind: str  # what the command goes to: bridge, steps or converter
    built: tuple  # what this node could drive, "fine" for the fine stage
    command: float  # of full scale, -1…1
    steps: int  # on the wire since reset
    fine_command: float  # of full scale, -1…1
    override: Fraction  # how fast profiles are played, of full speed; 0: paused


@dataclass(frozen=True)
class CalibrationState:
    reason: str  # "learning", or why nothing is learned just now
    settled: bool  # offset, gain, phase and harmonics are all known
    frozen: bool
    accepted: int  # times that something was learned since power-up
    refused: int  # bursts and passes of bursts that were not good enough
    scatter_nm: float  # standard error of what was learned last

    @property
    def words(self) -> str:
        return words(CALIBRATION_REASONS, [self.reason])


@dataclass(frozen=True)
class Signal:
    faults: tuple  # that stand now
    first: tuple  # that came first since reset()

    @property
    def fault_words(self) -> str:
        return words(SIGNAL_FAULTS, self.faults)

    @property
    def first_words(self) -> str:
        return words(SIGNAL_FAULTS, self.first)


@dataclass(frozen=True)
class Capture:
    sources: tuple  # names of CAPTURE_SOURCES; several if they came at once
    position_nm: float  # of the last sample before the event
    time_clk: int  # of the event, wraps at 2^32
    age_s: float  # of that sample


@dataclass(frozen=True)
class Compare:
    armed: bool
    passed: int  # points since arm
    late: bool  # a pulse had to wait for the one before it


@dataclass(frozen=True)
class ParameterValue:
    name: str
    id: int
    counts: int  # as on the line
    value: Fraction  # in `unit`
    unit: str
    minimum: Fraction
    maximum: Fraction
    default: Fraction
    text: str
    quantity: units.Quantity = field(repr=False)

    def written(self, digits: int | None = None) -> str:
        if self.name in CHOICES:
            return CHOICES[self.name][self.counts]
        return units.with_unit(self.quantity, self.value, digits)

    @property
    def range_words(self) -> str:
        if self.name in CHOICES:
            return ", ".join(CHOICES[self.name])
        return " to ".join(
            units.with_unit(self.quantity, end, 6) for end in (self.minimum, self.maximum)
        )


@dataclass
class Statistics:
    """What this host met on the line."""

    exchanges: int = 0
    repeats: int = 0
    no_answer: int = 0
    garbled: int = 0
    old_reply: int = 0


# ------------------------------------------------------------------ line


class Bus:
    """The nodes on one transport. `random_source` gives the first sequence number for each node."""

    FIND_ANSWER_S = 0.05
    FIND_TRIES = 2

    def __init__(
        self,
        transport: Transport,
        tries: int = 5,
        answer_s: float = 0.1,
        random_source: random.Random | None = None,
        poll_s: float = POLL_S,
    ):
        self.transport, self.tries, self.answer_s, self.poll_s = transport, tries, answer_s, poll_s
        self.random = random_source or random.SystemRandom()
        self.sequences, self.nodes = {}, {}
        self.statistics = Statistics()
        self.in_order = True  # false while words of a broken exchange may still be on the way
        self.syncs = 0  # of this host
        self.baud_changed = False  # by this host, from the one after power-up

    def exchange(self, address: int, operation: str, /, tries=None, answer_s=None, **fields):
        """One request, repeated where needed; returns the reply whatever its cause."""
        # after the first, the number differs from that of every frame the node can remember: a
        # request cannot be taken for an old one
        sequence = (
            (self.sequences[address] + 1) % 256
            if address in self.sequences
            else self.random.randrange(256)
        )
        self.sequences[address] = sequence
        character_s = self.transport.character_s
        timing = Timing(
            character_s, answer=answer_s or self.answer_s, quiet=max(0.01, 3 * character_s)
        )
        body = request_body(operation, sequence, **fields)
        return self.run_exchange(
            Exchange(address, body, tries or self.tries, timing, self.transport.handshake)
        ).result()

    def run_exchange(self, exchange: Exchange) -> Exchange:
        """Until it is finished, well or not."""
        if not self.in_order:
            self.wait_for_silence(exchange.timing)
        self.in_order = False
        self.statistics.exchanges += 1
        try:
            while not exchange.finished:
                self.step(exchange)
        finally:
            self.statistics.repeats += exchange.attempts - 1
            for event in exchange.events:
                name = event.replace(" ", "_")
                setattr(self.statistics, name, getattr(self.statistics, name) + 1)
        self.in_order = exchange.reply is not None
        return exchange

    def step(self, exchange: Exchange):
        sending = exchange.words_to_send()
        if sending:
            self.transport.send(sending)
        wanted = exchange.wanted
        received = self.transport.receive(wanted, exchange.timeout_s)
        exchange.feed(received)
        if len(received) < wanted:
            exchange.silence()

    def wait_for_silence(self, timing: Timing):
        for _ in range(Exchange.LONGEST_NOISE):
            if not self.transport.receive(1, timing.quiet):
                return

    def request(self, address: int, operation: str, /, **fields) -> dict:
        """The fields of the reply; Refused when the node says no."""
        reply = self.exchange(address, operation, **fields)
        if reply.cause == 0:
            return reply.fields
        cause = named(CAUSES, reply.cause, "cause")
        raise Refused(
            cause, reply.cause, f"node {address} refused '{operation}': {words(CAUSES, [cause])}"
        )

    def identify(self, address: int, **patience) -> Identity:
        reply = self.exchange(address, "identify", **patience)
        if reply.cause:
            cause = named(CAUSES, reply.cause, "cause")
            raise Refused(
                cause, reply.cause, f"node {address} refused 'identify': {words(CAUSES, [cause])}"
            )
        return Identity(**{**reply.fields, "address": address})

    def find(self, addresses=ADDRESSES) -> list:
        """Identities of all nodes that answer, of any build."""
        found = []
        for address in addresses:
            if not self.transport.reaches(address):
                continue
            try:
                found.append(
                    self.identify(address, tries=self.FIND_TRIES, answer_s=self.FIND_ANSWER_S)
                )
            except NoAnswer:
                continue
            if (
                found[-1].matches
            ):  # two nodes with one address may identify themselves as one; their times differ
                self.request(
                    address,
                    "read_register",
                    address=register_fields("node.time_stamp")[0].address(0),
                )
        return found

    def find_baud(self, addresses=ADDRESSES, rates=RATES) -> tuple:
        """As find(), at the first of these baud rates at which somebody answers, and that rate,
        which then stays; with an empty list where
        nobody does. A node that was not called for 5 s has gone back to the first rate, so that is
        asked at the end too."""
        self.require_direct_bus()
        garbled = None  # at a wrong rate it is somebody else's words
        for rate in (*rates, BAUD):
            found = []
            try:
                self.transport.set_baud(rate)
                found = self.find(addresses)
            except PortError:
                if rate == BAUD:  # which every port can do
                    raise
            except BusGarbled as error:
                garbled = garbled or error
            if found:
                return found, rate
        if garbled is not None:
            raise garbled
        return [], BAUD

    def require_direct_bus(self):
        if not self.transport.handshake:
            raise BusError(
                0, "this needs the nodes' own line: it cannot be asked for through a gateway to it"
            )

    def sync(self):
        """The same moment at all nodes, to within a microsecond: an axis that captures from
        "software" keeps its position, a motion
        that waits for a mark begins. Nobody answers; the nodes count marks."""
        self.require_direct_bus()
        self.syncs += 1
        self.transport.send(sync_words(self.syncs))
        self.transport.wait(SYNC_S)

    def start(self, *axes: "Axis", progress=None) -> list:
        """Begin the prepared motions of these axes, of several nodes, within a microsecond, or none
        of them; returns their Status when
        all have ended. Whatever interrupts the wait stops all of them under control first."""
        if not axes:
            raise OutOfRange("which axes shall start?")
        self.require_direct_bus()
        masks, begun = {}, False
        for axis in dict.fromkeys(axes):
            masks[axis.node.address] = masks.get(axis.node.address, 0) | 1 << axis.number
        try:
            for address, mask in masks.items():
                self.request(address, "start_at_sync", axes=mask)
            begun = True
            self.sync()
            for axis in axes:
                if axis.status().state == "prepared":
                    raise BusError(
                        axis.node.address,
                        "the node did not hear the mark at which its motion should begin",
                    )
            return [axis.wait(progress) for axis in axes]
        except BaseException:
            for address in masks:
                self.request(address, "start_at_sync", axes=0)
            for axis in axes if begun else ():
                axis.stop_if_enabled()
            raise

    def set_baud(self, baud: int, addresses):
        """This host and these nodes, all that anyone speaks to, at another baud rate. A node goes
        back to the first one after a break,
        and by itself when nobody called it for 5 s; all do when one of them does not follow."""
        self.require_direct_bus()
        try:
            for address in addresses:
                self.request(address, "set_baud", baud=baud)
            self.transport.wait(BAUD_CHANGE_S)
            self.transport.set_baud(baud)
            for address in addresses:
                self.identify(address)
        except BaseException:
            self.first_baud()
            raise
        self.baud_changed = True

    def first_baud(self):
        """All nodes, and this host, at the baud rate that they have after power-up."""
        self.transport.send_break()
        self.transport.set_baud(BAUD)
        self.transport.wait(BAUD_CHANGE_S)
        self.baud_changed = False

    def node(self, address: int = 1) -> "Node":
        """Connects at the first time: identifies the node and refuses one of another build."""
        if address not in self.nodes:
            self.nodes[address] = Node(self, address)
        return self.nodes[address]

    def axis(self, address: int = 1, axis: int = 0) -> "Axis":
        return self.node(address).axis(axis)


# ------------------------------------------------------------------ node


class Node:
    """One controller on the line. Made by Bus.node()."""

    def __init__(self, bus: Bus, address: int):
        self.bus, self.address = bus, address
        self.identity = bus.identify(address)
        self.identity.check()
        self.axes = {}

    def request(self, operation: str, **fields) -> dict:
        return self.bus.request(self.address, operation, **fields)

    def axis(self, number: int = 0) -> "Axis":
        if not 0 <= number < self.identity.axes:
            code = CAUSE_CODES["no_such_axis"]
            known = (
                "only axis 0" if self.identity.axes == 1 else f"axes 0 to {self.identity.axes - 1}"
            )
            raise Refused(
                "no_such_axis", code, f"node {self.address} has no axis {number}: it has {known}"
            )
        if number not in self.axes:
            self.axes[number] = Axis(self, number)
        return self.axes[number]

    def start(self, *axes: int, progress=None) -> list:
        """Begin the prepared motions of these axes in the very same tick, or none of them; returns
        their Status when all have ended.

        `progress` is called with a Status from time to time. Whatever interrupts the wait stops all
        of them under control first.
        """
        if not axes:
            raise OutOfRange("which axes shall start? Give their numbers")
        moving = [self.axis(number) for number in dict.fromkeys(axes)]
        self.request("start", axes=sum(1 << axis.number for axis in moving))
        try:
            return [axis.wait(progress) for axis in moving]
        except BaseException:
            for axis in moving:
                axis.stop_if_enabled()
            raise

    def counters(self) -> dict:
        """What the node met on the line, by name."""
        return self.request("counters")

    def read_register(self, address: int) -> int:
        """One 32-bit word of the register map."""
        if address % 4 or not 0 <= address < 65536:
            raise OutOfRange(
                f"{address:#x} is no register address: allowed are multiples of 4 from 0 to 0xfffc"
            )
        try:
            return self.request("read_register", address=address)["value"]
        except Refused as refused:
            raise with_more(refused, f"address {address:#06x}") from None

    def write_register(self, address: int, value: int):
        """Only index, capture and compare of the grating blocks may be written."""
        if address % 4 or not 0 <= address < 65536 or not 0 <= value < 1 << 32:
            raise OutOfRange(
                f"{value:#x} cannot go to {address:#x}: allowed are 32-bit words, and multiples of 4 from 0 to 0xfffc"
            )
        try:
            self.request("write_register", address=address, value=value)
        except Refused as refused:
            raise with_more(refused, f"address {address:#06x}") from None

    def write_named(self, name: str, axis: int = 0, **counts):
        """A whole register by its fields, those not given 0; a wide one low word first."""
        fields = {
            known.field: known for known in FIELDS if f"{known.block}.{known.register}" == name
        }
        word = sum(
            (count & (1 << fields[field].width) - 1) << fields[field].low
            for field, count in counts.items()
        )
        known = next(iter(fields.values()))
        self.write_register(known.address(axis), word & 0xFFFFFFFF)
        if known.width > 32:
            self.write_register(known.address(axis) + 4, word >> 32)

    def read_named(self, name: str, axis: int = 0) -> dict:
        """Counts of the fields of a register, by name: "axis.position", "bus.frames_good"."""
        fields = register_fields(name)
        address, wide = (
            fields[0].address(axis),
            max(field.low + field.width for field in fields) > 32,
        )
        word = self.read_register(address)
        if wide:  # reading the low word latched the high one
            word |= self.read_register(address + 4) << 32
        return {field.field: field.value(word) for field in fields}


def register_fields(name: str) -> list:
    fields = [known for known in FIELDS if f"{known.block}.{known.register}" == name]
    if not fields:
        several = ", ".join(dict.fromkeys(f"{known.block}.{known.register}" for known in FIELDS))
        raise UnknownName(
            f"there is no register '{name}': known are {several}, or an address such as 0x400"
        )
    if not any("r" in known.access for known in fields):
        raise OutOfRange(f"the register {name} can only be written")
    return fields


def with_more(error, more: str):
    """The same error with a fact at its end."""
    return type(error)(error.cause, error.code, f"{error} ({more})")


# ------------------------------------------------------------------ axis


class Axis:
    """One axis of a node. Made by Bus.axis() or Node.axis()."""

    def __init__(self, node: Node, number: int):
        self.node, self.number = node, number
        self.period_nm = self.read_period()
        self.resumed_at = None  # override that resume() brings back

    def read_period(self) -> Fraction:
        return Fraction(
            self.request("get_parameter", parameter=PARAMETERS["period"].id)["value"], 1000
        )

    @property
    def transport(self) -> Transport:
        return self.node.bus.transport

    def request(self, operation: str, **fields) -> dict:
        try:
            return self.node.request(operation, axis=self.number, **fields)
        except Refused as refused:
            if refused.cause in ("faulted", "fault_persists"):
                raise with_more(refused, self.status().fault_words or "no fault is left") from None
            raise

    # position

    def to_nm(self, counts: int) -> float:
        return float(counts * self.period_nm / COUNTS)

    def to_counts(self, nm) -> int:
        return round(units.parse_length(nm) * COUNTS / self.period_nm)

    def status(self) -> Status:
        told = self.request("status")
        flags = bits(FLAGS, told["flags"])
        return Status(
            state=named(STATES, told["state"], "state"),
            ended=named(CAUSES, told["ended"], "cause"),
            **{name: name in flags for name, _ in FLAGS.values()},
            faults=bits(FAULTS, told["faults"]),
            first_fault=bits(FAULTS, told["first_fault"]),
            encoder_events=bits(ENCODER_EVENTS, told["encoder_events"]),
            position_nm=self.to_nm(told["position"]),
            target_nm=self.to_nm(told["target"]),
            velocity_mm_s=self.to_nm(told["velocity"]) * self.node.identity.tick_hz / 1e6,
            drive_command=told["command"] / FULL_SCALE,
            counts=told["counts"],
        )

    def encoder(self) -> Encoder:
        told = self.request("encoder")
        return Encoder(
            sin=told["sin"],
            cos=told["cos"],
            phase=told["phase"] / COUNTS,
            amplitude=told["amplitude"],
            quadrature_count=told["quadrature_count"],
            rejected_pulses=told["rejected_pulses"],
            rejected_samples=told["rejected_samples"],
            home_phase_nm=self.to_nm(told["home_phase"]),
            home_margin=1 - abs(told["home_phase"]) / (COUNTS / 2),
            fault_position_nm=self.to_nm(told["fault_position"]),
        )

    # motion

    def enable(self):
        self.request("enable", on=1)

    def disable(self):
        self.request("enable", on=0)

    def reset(self):
        """Clear latched faults whose cause is gone. The drive stays off."""
        self.request("reset_faults")

    def stop(self):
        """Controlled stop; the drive stays on. Does not wait: see wait()."""
        self.request("stop")

    def home(self, progress=None, method=None) -> Status:
        """Find the zero; returns when it is reached. `progress` is called with a Status from time
        to time.

        `method` is a number of CiA 402, "s0" or "s3"; the parameter home_method keeps it. Without
        one that parameter holds.
        """
        if method is not None:
            self.set_parameter("home_method", method)
        return self.motion("home", progress)

    def move(self, nm=None, *, mm=None, by: bool = False, progress=None) -> Status:
        """To a position, or by a distance; returns when settled. The target is a number, or a text
        such as "1.5mm".
        """
        return self.to_target(
            "move", nm, mm, by, lambda **fields: self.motion("move", progress, **fields)
        )

    def begin_move(self, nm=None, *, mm=None, by: bool = False) -> float:
        """As move(), but returns at once, with the seconds that the motion takes at full speed. See
        wait(), pause() and stop().
        """
        return self.seconds(
            self.to_target("move", nm, mm, by, lambda **fields: self.request("move", **fields))
        )

    def prepare(self, nm=None, *, mm=None, by: bool = False) -> float:
        """Plan a move and let it wait for Node.start(), which begins those of several axes
        together. Returns its seconds.
        """
        return self.seconds(
            self.to_target(
                "prepare", nm, mm, by, lambda **fields: self.request("prepare", **fields)
            )
        )

    def seconds(self, told: dict) -> float:
        return told["duration_ticks"] / self.node.identity.tick_hz

    def to_target(self, operation: str, nm, mm, by: bool, go):
        if (nm is None) == (mm is None):
            raise OutOfRange(f"a {operation} needs a target in nm or in mm, and not both")
        target_nm = units.parse_length(nm) if mm is None else Fraction(mm) * 10**6
        if by:
            target_nm += Fraction(self.status().target_nm)
        try:
            return go(target=self.to_counts(target_nm))
        except Refused as refused:
            if refused.cause == "out_of_travel":
                low, high = (
                    self.get_parameter(name).written(9) for name in ("travel_low", "travel_high")
                )
                raise with_more(
                    refused, f"target {units.format_length(target_nm)}, allowed {low} to {high}"
                ) from None
            raise

    def override(self, share=None) -> Fraction:
        """How fast profiles are played, of full speed; given a share ("50%" or 0.5) it changes, in
        motion too.
        """
        if share is not None:
            self.resumed_at = None
            return self.set_parameter("feed_override", units.parse_share(share)).value
        return self.get_parameter("feed_override").value

    def pause(self):
        """Stand still in the middle of a motion, within its limits; resume() goes on."""
        before = self.override()
        if before:
            self.override(0)
            self.resumed_at = before

    def resume(self) -> Fraction:
        """Go on, with the override that was in force before pause(); at full speed if this program
        did not pause it.
        """
        return self.override(self.resumed_at or 1)

    def drive(self) -> Drive:
        """What drives the axis, and what it is told just now."""
        told = {
            name: self.node.read_named(f"actuator.{name}", self.number)
            for name in ("drive", "steps", "fine_command")
        }
        kinds = CHOICES["drive"]
        built = tuple(
            name for bit, name in enumerate((*kinds, "fine")) if told["drive"]["built"] >> bit & 1
        )
        return Drive(
            kind=kinds[told["drive"]["kind"]],
            built=built,
            command=self.status().drive_command,
            steps=told["steps"]["value"],
            fine_command=told["fine_command"]["value"] / FULL_SCALE,
            override=self.override(),
        )

    def motion(self, operation: str, progress, **fields) -> Status:
        """Whatever interrupts the wait, Ctrl-C too, stops the axis under control first."""

        def carry_out():
            self.request(operation, **fields)
            return self.wait(progress)

        return self.stopping_on_error(carry_out)

    def stopping_on_error(self, work):
        try:
            return work()
        except (BusError, Refused, MotionFailed):
            raise
        except BaseException:
            self.stop_and_wait()
            raise

    def motion_end(self, progress=None) -> Status:
        """Until the motion under way has ended; whatever interrupts the wait stops the axis under
        control first.
        """
        return self.stopping_on_error(lambda: self.wait(progress))

    def wait(self, progress=None) -> Status:
        """Until the motion under way has ended; MotionFailed unless it ended well."""
        while True:
            status = self.status()
            if progress is not None:
                progress(status)
            if status.ended != "running":
                break
            self.transport.wait(self.node.bus.poll_s)
        if status.ended in ("ok", "no_motion_yet"):
            return status
        sentence = f"axis {self.number} of node {self.node.address}: {status.ended_words}"
        if status.ended == "ended_by_fault":
            sentence += f": {words(FAULTS, status.first_fault or status.faults)}"
        sentence += f" (at {units.format_length(status.position_nm)}, target {units.format_length(status.target_nm)})"
        raise MotionFailed(status.ended, CAUSE_CODES.get(status.ended, -1), sentence)

    def stop_and_wait(self):
        try:
            self.stop()
            while self.status().in_motion:
                self.transport.wait(self.node.bus.poll_s)
        except Refused:
            pass  # the drive is off
        except (BusError, PortError) as error:
            error.args = (
                f"axis {self.number} of node {self.node.address} could not be told to stop, its watchdog has to: {error}",
            )
            raise error from None

    def stop_if_enabled(self):
        """One of several that are to stop: what keeps it from stopping must not keep the others."""
        try:
            self.stop_and_wait()
        except MoireError:
            pass

    def dwell(self, seconds: float, progress=None) -> Status:
        """Let time pass, talking often enough for the watchdog."""
        end = self.transport.now() + seconds
        while True:
            status = self.status()
            if progress is not None:
                progress(status)
            left = end - self.transport.now()
            if left <= 0:
                return status
            self.transport.wait(min(self.node.bus.poll_s, left))

    # parameters

    def parameter_value(self, name: str, counts: int, period_nm=None) -> ParameterValue:
        known = parameter(name)
        return value_of(known, counts, one_count(known, period_nm or self.period_nm))

    def get_parameter(self, name: str) -> ParameterValue:
        return self.parameter_value(
            name, self.request("get_parameter", parameter=parameter(name).id)["value"]
        )

    def parameter_counts(self, name: str, value, period_nm=None) -> int:
        """What the wire carries for a value in real units; OutOfRange says what is allowed."""
        known = parameter(name)
        return counts_of(known, value, one_count(known, period_nm or self.period_nm))

    def set_parameter(self, name: str, value) -> ParameterValue:
        """`value` is a number in the unit of get_parameter(), or a text with a unit. Returns what
        was set: the nearest count.
        """
        return self.write_parameter(name, self.parameter_counts(name, value))

    def write_parameter(self, name: str, counts: int) -> ParameterValue:
        try:
            self.request("set_parameter", parameter=parameter(name).id, value=counts)
        except Refused as refused:
            raise with_more(
                refused, f"{name} {self.parameter_value(name, counts).written(6)}"
            ) from None
        if name == "period":
            self.period_nm = self.read_period()
        return self.parameter_value(name, counts)

    def parameters(self) -> dict:
        """All, by name."""
        return {name: self.get_parameter(name) for name in PARAMETERS}

    def save_parameters(self) -> dict:
        """All as exact texts, ready for a JSON file."""
        return {name: value.written() for name, value in self.parameters().items()}

    def load_parameters(self, texts: dict) -> dict:
        """Some or all, as saved. Every one is checked before the first is written; the period goes
        first, since lengths hang on it.
        """
        return {
            name: self.write_parameter(name, value)
            for name, value in self.check_parameters(texts).items()
        }

    def check_parameters(self, texts: dict) -> dict:
        """Counts of some or all, as saved, the period first; OutOfRange or UnknownName if they
        cannot be loaded.
        """
        period_nm = self.period_nm
        if "period" in texts:
            period_nm = Fraction(self.parameter_counts("period", texts["period"]), 1000)
        return {
            name: self.parameter_counts(name, texts[name], period_nm)
            for name in sorted(texts, key=lambda name: name != "period")
        }

    def set_tuning(self, tuning):
        """Gains and filters of moire.tune, written as they are; filters that it has none of are out
        of use.
        """
        if len(tuning.filters) > FILTERS:
            raise OutOfRange(f"the servo has {FILTERS} filters, the tuning {len(tuning.filters)}")
        self.write_parameter("filters", 0)
        for name in ("kp", "ki", "kd", "kv", "ka"):
            self.write_parameter(name, getattr(tuning, name))
        for number, coefficients in enumerate(tuning.filters, 1):
            for name, value in zip(FILTER, coefficients):
                self.write_parameter(f"filter_{number}_{name}", value)
        self.write_parameter("filters", (1 << len(tuning.filters)) - 1)

    # correction

    def calibration(self, action: str = "read") -> CalibrationState:
        """What the learner does; or "calibrate", "freeze", "clear"."""
        actions = {name: code for code, (name, _) in CALIBRATION_ACTIONS.items()}
        if action not in actions:
            raise OutOfRange(f"the learner knows no '{action}': allowed are {', '.join(actions)}")
        told = self.request("calibration", action=actions[action])
        return CalibrationState(
            reason=named(CALIBRATION_REASONS, told["reason"], "reason"),
            settled=bool(told["converged"]),
            frozen=bool(told["frozen"]),
            accepted=told["accepted"],
            refused=told["refused"],
            scatter_nm=float(told["scatter"] * self.period_nm / SCATTER),
        )

    def calibrate(self, progress=None, distance="1mm", timeout="120s") -> CalibrationState:
        """Learns the correction afresh: to and fro over a distance at several speeds until it is
        settled, then freezes it.

        The axis must be enabled and homed. It goes from where it is, to the side where there is
        room, and comes back; the farther,
        the faster, and fringes must come faster than the table can follow or ring. `progress` is
        called with a Learner after each
        way. NotCalibrated says why it was not settled in time. The parameter `velocity` is set as
        it was.
        """
        stretch, patience = units.parse_length(distance), units.parse_time(timeout)
        if stretch <= 0 or patience <= 0:
            raise OutOfRange("distance and timeout of learning must be above zero")
        low, high = (self.get_parameter(name).value for name in ("travel_low", "travel_high"))
        home = Fraction(self.status().target_nm)
        away = home + stretch if home + stretch <= high else home - stretch
        if away < low:
            raise OutOfRange(
                f"there is no room for {units.format_length(stretch)}: the travel is {units.format_length(low)} to "
                f"{units.format_length(high)}"
            )
        velocity = self.get_parameter("velocity")
        even = stretch / self.period_nm / Fraction(CALIBRATION_STROKE_S)
        fastest = min(velocity.counts, self.node.identity.sample_hz // CALIBRATION_SAMPLES, even)
        self.calibration("clear")
        self.calibration("calibrate")
        end, ways = self.transport.now() + float(patience), 0
        try:
            while True:
                self.write_parameter(
                    "velocity",
                    max(
                        1, round(fastest * CALIBRATION_SPEEDS[ways // 2 % len(CALIBRATION_SPEEDS)])
                    ),
                )
                self.move(home if ways % 2 else away)
                ways += 1
                told = self.calibration()
                if progress is not None:
                    progress(told)
                if told.settled and ways % 2 == 0:
                    return self.calibration("freeze")
                if self.transport.now() > end:
                    sentence = f"axis {self.number} of node {self.node.address} learned no correction within {units.format_time(patience)}"
                    raise NotCalibrated(
                        told.reason,
                        f"{sentence}: {told.words} ({told.accepted} accepted, {told.refused} refused)",
                    )
        finally:
            self.end_calibration(velocity)

    def end_calibration(self, velocity):
        try:
            self.calibration("freeze")
            self.write_parameter("velocity", velocity.counts)
        except MoireError:
            pass  # the line is silent or the axis still moves; what ended the learning is told

    def correction(self) -> dict:
        """What is in force, in counts, ready for a JSON file."""
        told = self.request("get_correction")
        harmonics = [self.request("get_harmonic", order=order) for order in range(1, HARMONICS + 1)]
        return {
            **told,
            "cosine": [harmonic["cosine"] for harmonic in harmonics],
            "sine": [harmonic["sine"] for harmonic in harmonics],
        }

    def set_correction(self, values: dict):
        """As from correction(); comes into force at once and whole, or not at all."""
        legs = values.get("cosine"), values.get("sine")
        right = all(whole(values.get(name)) for name in CORRECTION) and all(
            isinstance(leg, list) and len(leg) == HARMONICS and all(map(whole, leg)) for leg in legs
        )
        if not right:
            raise OutOfRange(
                f"this is no correction: it has the whole numbers {', '.join(CORRECTION)} and the lists cosine and sine of "
                f"{HARMONICS} whole numbers each"
            )
        for order, (cosine, sine) in enumerate(zip(*legs), 1):
            self.request("set_harmonic", order=order, cosine=cosine, sine=sine)
        self.request("set_correction", **{name: values[name] for name in CORRECTION}, apply=1)

    # signal

    def has_sine(self) -> bool:
        """Whether sine and cosine were built; without, the position is made of counts, and what
        needs them is refused.
        """
        return bool(self.feedback("position_source")["sine"])

    def signal(self) -> Signal:
        """What is wrong with sine and cosine."""
        told = self.request("signal")
        return Signal(bits(SIGNAL_FAULTS, told["faults"]), bits(SIGNAL_FAULTS, told["first"]))

    # capture and compare

    def feedback(self, register: str) -> dict:
        return self.node.read_named(f"feedback.{register}", self.number)

    def write_feedback(self, register: str, **counts):
        self.node.write_named(f"feedback.{register}", self.number, **counts)

    def capture_from(self, *sources: str):
        """From which sources positions are captured from here on; none: no more. What waits is
        kept.
        """
        self.write_feedback(
            "capture_sources",
            value=sum(
                1 << CAPTURE_SOURCES.index(capture_source(source)) for source in set(sources)
            ),
        )
        if "index" in sources:
            self.write_feedback("strobes", arm_index=1)

    def capture_now(self):
        """One capture of the source "software", if that is on."""
        self.write_feedback("strobes", capture_now=1)

    def captures(self, most: int = 16) -> tuple:
        """Takes the captures that wait, oldest first; and whether some were lost since the last
        time.
        """
        taken, sources = [], dict(enumerate((name, name) for name in CAPTURE_SOURCES))
        overrun = bool(self.feedback("capture_state")["overrun"])
        while len(taken) < most and self.feedback("capture_state")["present"]:
            told, clk_hz = self.feedback("captured"), self.node.identity.clk_hz
            taken.append(
                Capture(
                    bits(sources, told["sources"]),
                    self.to_nm(self.feedback("captured_position")["value"]),
                    self.feedback("captured_time")["value"],
                    told["age"] / clk_hz,
                )
            )
            self.write_feedback("strobes", capture_next=1)
        if overrun:
            self.write_feedback("capture_state", overrun=1)
        return taken, overrun

    def compare(self) -> Compare:
        state = self.feedback("compare_state")
        return Compare(
            bool(state["armed"]), self.feedback("compare_passed")["value"], bool(state["late"])
        )

    def compare_from(self, start, step, count: int = 0, pulse="1us", gap="1us"):
        """Pulses at start, start + step, …: so many, or without end for 0. A step below zero is for
        motion downwards.
        """
        places = {"compare_start": self.to_counts(start), "compare_step": self.to_counts(step)}
        clk_hz = self.node.identity.clk_hz
        times = {
            "compare_pulse": round(units.parse_time(pulse) * clk_hz),
            "compare_gap": round(units.parse_time(gap) * clk_hz),
        }
        if (
            not all(-(1 << 47) <= place < 1 << 47 for place in places.values())
            or places["compare_step"] == 0
        ):
            raise OutOfRange(
                "start and step must be lengths inside the range of positions, the step not zero"
            )
        if not all(1 <= clk < 1 << 24 for clk in times.values()) or not 0 <= count < 1 << 32:
            shortest, longest = (units.format_time(Fraction(clk, clk_hz)) for clk in (1, 2**24 - 1))
            raise OutOfRange(
                f"pulse and gap allow {shortest} to {longest}, the count 0 to 2^32 - 1"
            )
        self.compare_off()
        for name, value in {**places, "compare_count": count, **times}.items():
            self.write_feedback(name, value=value)
        self.write_feedback("compare_state", late=1)
        self.write_feedback("strobes", compare_arm=1)

    def compare_off(self):
        self.write_feedback("strobes", compare_disarm=1)


def whole(value) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def capture_source(name: str) -> str:
    if name not in CAPTURE_SOURCES:
        raise UnknownName(
            f"there is no capture source '{name}': known are {', '.join(CAPTURE_SOURCES)}"
        )
    return name


def choice(name: str, text: str) -> int | None:
    """The counts that a word stands for; None where numbers may be written and this is one."""
    if name == "home_method" and text.strip() in HOME_METHODS:
        return HOME_METHODS[text.strip()]
    if name == "feed_override" and text.strip().endswith("%"):
        return round(units.parse_share(text) / PARAMETERS[name].lsb)
    if name not in CHOICES or re.fullmatch(r"\s*[+-]?[0-9.]+\s*", text):
        return None
    if text.strip() not in CHOICES[name]:
        raise OutOfRange(f"{name} is no '{text.strip()}': allowed are {', '.join(CHOICES[name])}")
    return CHOICES[name].index(text.strip())


def parameter(name: str):
    if name not in PARAMETERS:
        raise UnknownName(f"there is no parameter '{name}': known are {', '.join(PARAMETERS)}")
    return PARAMETERS[name]


def one_count(known, period_nm: Fraction) -> Fraction:
    _, worth, periodic = KINDS[known.unit]
    return known.lsb * worth * (period_nm if periodic else 1)


def value_of(known, counts: int, one: Fraction) -> ParameterValue:
    """Of a parameter or a setting, one count of which is worth so much."""
    quantity = KINDS[known.unit][0]
    return ParameterValue(
        known.name,
        known.id,
        counts,
        counts * one,
        quantity.base,
        known.min * one,
        known.max * one,
        known.default * one,
        known.text,
        quantity,
    )


def counts_of(known, value, one: Fraction) -> int:
    """What the wire carries for a value in real units; OutOfRange says what is allowed."""
    if isinstance(value, str) and (chosen := choice(known.name, value)) is not None:
        return chosen
    quantity = KINDS[known.unit][0]
    wanted = quantity.parse(value)
    counts = round(wanted / one)
    if not known.min <= counts <= known.max:
        allowed = value_of(known, known.default, one).range_words
        raise OutOfRange(
            f"{known.name} allows {allowed}, not {units.with_unit(quantity, wanted, 6)}"
        )
    if known.lsb == 1 and not known.unit and wanted != counts:
        raise OutOfRange(f"{known.name} takes whole numbers, not {units.decimal(wanted)}")
    return counts

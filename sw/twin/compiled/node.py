# SPDX-License-Identifier: Apache-2.0
"""A node without hardware: the compiled firmware, and in place of its registers a bus, a clock and
simple axes in Python.

The player adds up the segments as they were pushed: without B-spline between their steps or limit
of jerk. A feed override leaves out ticks, and changes at once. A controlled stop takes
stop_deceleration off the velocity each tick, and a profile starts at full speed. What
rtl/control/motion_engine.sv does beyond this is tested with its own model, and with the RTL in
tb/system. Each tick the position moves by half the distance to the target; an axis whose drive is
off does not move, and it slides a little past a limit switch that has closed. Faults latch as
drive_interlock does it.
"""

import re
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol

from tables import bus
from twin.build import FIRMWARE
from twin.compiled.firmware import READ, WRITE, power_up

DEFINES = {
    name: int(value.rstrip("u"), 0)
    for name, value in re.findall(
        r"^#define (\w+)\s+(0x[0-9a-fA-F]+u?|\d+u?)\b",
        (FIRMWARE / "made" / "registers.h").read_text(),
        re.M,
    )
}
TABLE = bus.read()
CAUSE: dict[int, str] = {code: name for name, (code, _) in TABLE["cause"].items()}
STATE: dict[int, str] = {code: name for name, (code, _) in TABLE["state"].items()}
FAULT = {name: 1 << bit for name, (bit, _) in TABLE["fault"].items()}
FLAG = {name: 1 << bit for name, (bit, _) in TABLE["flag"].items()}
PARAMETER = TABLE["parameter"]
CLK_HZ = 4_000_000
PERIOD = 65536
FULL_SPEED = 1 << 16  # of the feed override
SLIDE = 30 * PERIOD  # past a closed switch
BACKLASH = PERIOD // 2  # a switch opens so far from where it closed
INDEX, SOFTWARE = 1 << 0, 1 << 2  # bits of capture_sources
END_OF_MAP = 1 << 16  # the port of the flash begins here
ALWAYS_LATCHED = FAULT["estop"] | FAULT["drive"] | FAULT["cpu"]


def signed(value: int, bits: int) -> int:
    """The number that the low `bits` of a word hold as two's complement."""
    return value - (1 << bits) if value >> bits - 1 & 1 else value


def fields(declarations: Iterable[str], data: bytes) -> dict[str, int]:
    """The numbers in data by the declarations "name u16" of bus.toml, little endian."""
    values, at = {}, 0
    for declaration in declarations:
        name, kind = declaration.split()
        size = int(kind[1:]) // 8
        values[name] = int.from_bytes(data[at : at + size], "little", signed=kind[0] == "i")
        at += size
    assert at == len(data)
    return values


class Player:
    """The profile player: adds up segments, (velocity, acceleration, jerk, ticks, last)."""

    def __init__(self) -> None:
        self.target = 0  # 2^-40 period
        self.velocity = self.acceleration = self.jerk = self.left = self.last = 0
        self.queue: deque[tuple[int, int, int, int, int]] = deque()
        self.moving = self.braking = False
        self.stop_deceleration = 0

    def hold(self, position: int) -> None:
        """Stand still at a position, 2^-16 period, without segments."""
        self.__init_motion()
        self.target = position << 24

    def __init_motion(self) -> None:
        self.queue.clear()
        self.moving = self.braking = False
        self.left = self.last = self.velocity = 0

    def controlled_stop(self) -> None:
        """Drop the segments and slow down."""
        self.queue.clear()
        self.braking = self.moving

    def tick(self) -> bool:
        """One servo tick; returns True if the segments ran out."""
        if not self.moving:
            return False
        underrun = False
        if not self.braking and self.left == 0:
            if self.queue:
                self.velocity, self.acceleration, self.jerk, self.left, self.last = (
                    self.queue.popleft()
                )
            else:
                underrun = self.braking = True
        self.target += self.velocity
        if self.braking:
            rate = self.stop_deceleration << 8
            stop = rate == 0 or abs(self.velocity) <= rate
            self.velocity -= self.velocity if stop else rate if self.velocity > 0 else -rate
        else:
            self.velocity, self.acceleration, self.left = (
                self.velocity + self.acceleration,
                self.acceleration + self.jerk,
                self.left - 1,
            )
            stop = bool(self.last) and self.left == 0
        if stop:
            self.target = self.target + (1 << 23) >> 24 << 24
            self.__init_motion()
        return underrun


class Axis:
    """An axis with drive, limit switches and index marks."""

    def __init__(
        self,
        position: int = 0,
        low: int | None = None,
        high: int | None = None,
        index: Sequence[int] = (),
    ) -> None:
        """At a position, 2^-16 period. The limit switches close at `low` and `high`, and index
        marks are at `index`; these are positions of the machine, which the origin of the node does
        not move.
        """
        self.word: dict[int, int] = {}  # of registers that only hold what was written
        self.latch = 0
        self.machine, self.origin = position, 0  # position = machine + origin
        self.low_at, self.high_at = low, high
        self.pressed_low = low is not None and position <= low
        self.pressed_high = high is not None and position >= high
        self.stuck_low = False
        self.player = Player()
        self.player.target = position << 24
        self.progress = 0  # of the player within a tick, 2^-16
        self.faults = self.first_fault = self.fault_position = 0
        self.causes = 0  # those that the test sets
        self.enabled = self.seized = False
        self.speed = 0
        self.passed: int | None = None  # position of the index mark met in the last tick
        self.index = index
        self.strobes: list[tuple[int, int]] = []  # (strobes, control) in order
        self.pushed: list[tuple[int, int, int, int, int]] = []

    @property
    def position(self) -> int:
        """As the node counts it, 2^-16 period."""
        return self.machine + self.origin

    @property
    def target(self) -> int:
        """Of the player, 2^-16 period."""
        return self.player.target >> 24

    @property
    def error(self) -> int:
        """The following error, 2^-16 period."""
        return self.target - self.position

    @property
    def control(self) -> int:
        """The control register."""
        return self.word.get(DEFINES["AXIS_CONTROL"], 0)

    def requests(self, field: str) -> bool:
        """Whether all bits of a field of the control register are 1."""
        mask = DEFINES[f"AXIS_CONTROL_{field}_MASK"]
        return self.control & mask == mask

    def interlock(self, strobe_cause: int = 0) -> int:
        """Latch the faults whose causes are present, and switch the drive; returns those causes."""
        causes = self.causes | strobe_cause
        if not self.requests("HOMING"):
            causes |= (
                FAULT["limit_low"] * self.pressed_low | FAULT["limit_high"] * self.pressed_high
            )
        limit = self.word.get(DEFINES["AXIS_FOLLOWING_LIMIT"], 0)
        loops = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"] | DEFINES["AXIS_CONTROL_FINE_MASK"]
        if self.enabled and self.control & loops and limit and abs(self.error) > limit:
            causes |= FAULT["following_error"]
        enable = self.requests("ENABLE")
        arrived = causes & (-1 if enable else ALWAYS_LATCHED)
        if arrived and not self.faults:
            self.first_fault, self.fault_position = arrived & -arrived, self.position
        self.faults |= arrived
        self.enabled = enable and not self.faults
        return causes

    def reset(self) -> None:
        """Reset the faults whose causes are gone, while the drive is disabled."""
        if not self.requests("ENABLE"):
            self.faults &= self.interlock()
            if not self.faults:
                self.first_fault = 0

    def tick(self) -> None:
        """One servo tick of player, drive and switches."""
        override = self.word.get(DEFINES["AXIS_FEED_OVERRIDE"], FULL_SPEED)
        self.progress += FULL_SPEED if self.player.braking else override
        underrun = False
        if self.progress >= FULL_SPEED:
            self.progress -= FULL_SPEED
            underrun = self.player.tick()
        old = self.machine
        if self.enabled and not self.seized:
            step = (
                self.error - self.error // 2
                if self.error > 0
                else -(-self.error - -self.error // 2)
            )
            limit = self.low_at - SLIDE if self.low_at is not None else None
            self.machine = (
                self.machine + step
                if limit is None
                else max(self.machine + step, min(limit, self.machine))
            )
        self.speed = self.machine - old
        met = [
            mark for mark in self.index if min(old, self.machine) < mark <= max(old, self.machine)
        ]
        self.passed = met[0 if self.speed > 0 else -1] + self.origin if met else None
        if self.low_at is not None:
            if self.machine <= self.low_at:
                self.pressed_low = True
            elif self.machine > self.low_at + BACKLASH and not self.stuck_low:
                self.pressed_low = False
        if self.high_at is not None:
            if self.machine >= self.high_at:
                self.pressed_high = True
            elif self.machine < self.high_at - BACKLASH:
                self.pressed_high = False
        self.interlock(FAULT["profile_underrun"] if underrun else 0)

    def read(self, offset: int) -> int:
        """A register of the axis block."""
        d = DEFINES
        wide = {
            d["AXIS_POSITION"]: self.position,
            d["AXIS_TARGET"]: self.target,
            d["AXIS_FAULT_POSITION"]: self.fault_position,
        }
        if offset in wide:
            self.latch = wide[offset] >> 32 & 0xFFFF
            return wide[offset] & 0xFFFFFFFF
        if offset - 4 in wide:
            return self.latch
        if offset == d["AXIS_STATE"]:
            return (
                d["AXIS_STATE_ENABLED_MASK"] * self.enabled
                | d["AXIS_STATE_LIMIT_LOW_MASK"] * self.pressed_low
                | d["AXIS_STATE_LIMIT_HIGH_MASK"] * self.pressed_high
                | d["AXIS_STATE_MOVING_MASK"] * self.player.moving
                | d["AXIS_STATE_ESTOP_MASK"] * bool(self.causes & FAULT["estop"])
                | 16 - len(self.player.queue) << d["AXIS_STATE_QUEUE_FREE_SHIFT"]
            )
        special = {
            d["AXIS_FAULTS"]: self.faults,
            d["AXIS_CAUSES_NOW"]: self.interlock(),
            d["AXIS_FIRST_FAULT"]: self.first_fault,
            d["AXIS_FOLLOWING_ERROR"]: max(-(2**31), min(2**31 - 1, self.error)),
            d["AXIS_VELOCITY"]: self.speed,
        }
        return special.get(offset, self.word.get(offset, 0)) & 0xFFFFFFFF

    def write(self, offset: int, value: int) -> None:
        """Write a register of the axis block."""
        d = DEFINES
        if offset == d["AXIS_STROBES"]:
            self.strobes.append((value, self.control))
            if value & d["AXIS_STROBES_SET_TARGET_TO_POSITION_MASK"]:
                self.player.hold(self.position)
            if value & d["AXIS_STROBES_CONTROLLED_STOP_MASK"]:
                self.player.controlled_stop()
            if value & d["AXIS_STROBES_START_MASK"] and self.player.queue:
                self.player.moving = True
            if value & d["AXIS_STROBES_RESET_FAULTS_MASK"]:
                self.reset()
            return
        if offset == d["AXIS_SHIFT_ORIGIN"]:
            self.origin += signed(value, 32) * PERIOD
            self.player.target += signed(value, 32) << 40
        self.word[offset] = value
        if offset == d["AXIS_ENCODER_EVENTS"]:
            self.word[offset] = 0
        if offset == d["AXIS_STOP_DECELERATION"]:
            self.player.stop_deceleration = value
        if offset == d["AXIS_CONTROL"]:
            self.interlock()
        if offset == d["AXIS_SEGMENT_TICKS"]:
            assert len(self.player.queue) < 16, "a segment was lost: the queue was full"
            velocity, acceleration = (
                signed(
                    self.word[d[f"AXIS_SEGMENT_{name}_HIGH"]] << 32
                    | self.word[d[f"AXIS_SEGMENT_{name}_LOW"]],
                    64,
                )
                for name in ("VELOCITY", "ACCELERATION")
            )
            segment = (
                velocity,
                acceleration,
                signed(self.word[d["AXIS_SEGMENT_JERK"]], 32),
                value & 0xFFFFFF,
                value >> 24 & 1,
            )
            self.player.queue.append(segment)
            self.pushed.append(segment)


class FeedbackChannel:
    """The registers of a feedback channel. `burst(phases, every)` gives the 1024 words of a burst,
    which is full after `delay` polls.
    """

    def __init__(self) -> None:
        self.word: dict[int, int] = {}
        self.strobes: list[int] = []
        self.records: list[tuple[bool, int]] = []  # (phases, decimation) of each recording
        self.burst: Callable[[bool, int], Sequence[int]] | None = None
        self.spoiled, self.delay = False, 0
        self.waiting, self.taken, self.full = 0, 0, False
        self.words: Sequence[int] = []
        self.points: dict[int, int] = {}  # the table in force
        self.written: dict[int, int] = {}  # the table that is being written
        self.correction: dict[str, int] | None = None
        self.loads = 0
        # waiting captures, oldest first: the register `captured`, cycle, 2^-16 period
        self.captures: deque[tuple[int, int, int]] = deque()
        self.armed, self.latch = False, 0
        self.segments: dict[int, int] = {}
        self.use: dict[str, Any] | None = None  # the settings in force
        self.uses: list[bool | None] = []  # whether linear, of each use; None: out of force

    def capture(self, source: int, clk: int, position: int) -> None:
        """An event of this bit of capture_sources, which is captured if that is selected."""
        if self.word.get(DEFINES["FEEDBACK_CAPTURE_SOURCES"], 0) & source:
            self.captures.append((source, clk, position))

    def index(self, clk: int, position: int) -> None:
        """An index mark passes at a position."""
        each = self.word.get(DEFINES["FEEDBACK_INDEX"], 0) & DEFINES["FEEDBACK_INDEX_EACH_MASK"]
        if self.armed or each:
            self.armed = False
            self.capture(INDEX, clk, position)

    def read(self, offset: int) -> int:
        """A register of the feedback block."""
        d = DEFINES
        if offset == d["FEEDBACK_RECORDER_STATE"]:
            self.waiting -= 1
            self.full = bool(self.records) and self.burst is not None and self.waiting < 0
            return self.full | self.spoiled << 1
        if offset == d["FEEDBACK_RECORDER_WORD"]:
            assert self.full, "a word was read that is not there"
            self.taken += 1
            return self.words[(self.taken - 1) % len(self.words)]
        if offset == d["FEEDBACK_CAPTURE_STATE"]:
            present = d["FEEDBACK_CAPTURE_STATE_PRESENT_MASK"] * bool(self.captures)
            return present | self.word.get(offset, 0)
        if offset == d["FEEDBACK_CAPTURED"] and self.captures:
            return self.captures[0][0]
        if offset == d["FEEDBACK_CAPTURED_TIME"] and self.captures:
            return self.captures[0][1] & 0xFFFFFFFF
        if offset == d["FEEDBACK_CAPTURED_POSITION"] and self.captures:
            self.latch = self.captures[0][2] >> 32 & 0xFFFF
            return self.captures[0][2] & 0xFFFFFFFF
        if offset == d["FEEDBACK_CAPTURED_POSITION"] + 4:
            return self.latch
        if offset == d["FEEDBACK_SEGMENT_STATE"]:
            return (
                d["FEEDBACK_SEGMENT_STATE_IN_FORCE_MASK"] * (self.use is not None)
                | d["FEEDBACK_SEGMENT_STATE_KNOWN_MASK"]
            )
        if offset == d["FEEDBACK_SEGMENT_STORED"]:
            return self.segments.get(self.word[d["FEEDBACK_SEGMENT_READ"]], 0) & 0xFFFFFFFF
        return self.word.get(offset, 0)

    def wide(self, name: str, bits: int) -> int:
        """The signed number that was written to NAME_HIGH and NAME_LOW."""
        return signed(
            self.word[DEFINES[f"{name}_HIGH"]] << 32 & (1 << bits) - 1
            | self.word[DEFINES[f"{name}_LOW"]],
            bits,
        )

    def use_segments(self, value: int) -> None:
        """Put the segment table into force, or out of it, as the register segment_use demands."""
        self.use = (
            dict(
                linear=bool(value & 2),
                segments=value >> 2,
                length=self.wide("FEEDBACK_SEGMENT_LENGTH", 48),
                origin=self.wide("FEEDBACK_SEGMENT_ORIGIN", 48),
            )
            if value & 1
            else None
        )
        self.uses.append(self.use["linear"] if self.use else None)

    def write(self, offset: int, value: int) -> None:
        """Write a register of the feedback block."""
        d = DEFINES
        if offset in (d["FEEDBACK_CAPTURE_STATE"], d["FEEDBACK_COMPARE_STATE"]):
            self.word[offset] = self.word.get(offset, 0) & ~value  # writing 1 clears a bit
            return
        self.word[offset] = value
        if offset == d["FEEDBACK_SEGMENT_POINT"]:
            self.segments[value >> 24] = signed(value & 0xFFFFFF, 24)
        if offset == d["FEEDBACK_SEGMENT_USE"]:
            self.use_segments(value)
        if offset == d["FEEDBACK_HARMONIC_POINT"]:
            self.written[value >> 18 & 255] = signed(value & 0x3FFFF, 18)
        if offset == d["FEEDBACK_STROBES"]:
            self.strobes.append(value)
            self.armed = self.armed or bool(value & d["FEEDBACK_STROBES_ARM_INDEX_MASK"])
            if value & d["FEEDBACK_STROBES_CAPTURE_CLEAR_MASK"]:
                self.captures.clear()
            if value & d["FEEDBACK_STROBES_CAPTURE_NEXT_MASK"] and self.captures:
                self.captures.popleft()
            if value & d["FEEDBACK_STROBES_RECORD_MASK"]:
                setting = self.word[d["FEEDBACK_RECORDER"]]
                self.records.append((bool(setting >> 16 & 1), setting & 0xFFFF))
                self.waiting, self.taken, self.full = self.delay, 0, False
                self.words = self.burst(*self.records[-1]) if self.burst else []
            if value & d["FEEDBACK_STROBES_LOAD_CORRECTION_MASK"]:
                offsets = self.word[d["FEEDBACK_CORRECTION_OFFSET"]]
                self.correction = dict(
                    sin_offset=signed(offsets & 0xFFFF, 16),
                    cos_offset=signed(offsets >> 16, 16),
                    gain=self.word[d["FEEDBACK_CORRECTION_GAIN"]],
                    quadrature_error=signed(
                        self.word[d["FEEDBACK_CORRECTION_QUADRATURE_ERROR"]], 17
                    ),
                )
            if value & d["FEEDBACK_STROBES_SWAP_HARMONICS_MASK"]:
                assert len(self.written) == 256, "a table was put into force before it was complete"
                self.points, self.written, self.loads = self.written, {}, self.loads + 1


class TickScope:
    """The recorder of ticks and the excitation, by the registers of the node; a sample at once."""

    EMPTY, WAITING, RECORDING, FULL = range(4)  # scope_state of bus.toml

    def __init__(self, words: int) -> None:
        self.size = words
        self.word: dict[int, int] = {}
        self.waveform: dict[int, int] = {}
        self.samples: list[list[int]] = []
        self.recorded: list[int] = []  # words of a recording that has begun
        self.phase = self.EMPTY
        self.taken = self.passed = 0
        self.delay: int | None = None  # ticks that are left of it, while it runs
        self.was_above: bool | None = None  # the signal of the trigger; None: not seen yet

    def field(self, name: str) -> int:
        """A field of a setting, by its name in the header of the registers."""
        registers = ("SCOPE_SAMPLES", "SCOPE_PLACE", "SCOPE", "EXCITATION")
        register = next(d for d in registers if name.startswith(d))
        value = self.word.get(DEFINES[f"NODE_{register}"], 0)
        return (value & DEFINES[f"NODE_{name}_MASK"]) >> DEFINES[f"NODE_{name}_SHIFT"]

    def write(self, offset: int, value: int) -> None:
        """Write a register of the node."""
        self.word[offset] = value
        if offset == DEFINES["NODE_EXCITATION_VALUE"]:
            self.waveform[value >> 16 & 0xFFF] = signed(value & 0xFFFF, 16)
        if offset == DEFINES["NODE_SCOPE_LEVEL"]:
            self.samples, self.recorded, self.phase = [], [], self.WAITING
            self.taken, self.delay, self.was_above = 0, None, None
            self.passed = self.field("SCOPE_SAMPLES_EVERY")

    @property
    def available(self) -> int:
        """Words that can be read."""
        stream = self.phase == self.RECORDING and self.field("SCOPE_SAMPLES_LENGTH") == 0
        return len(self.recorded) - self.taken if stream or self.phase == self.FULL else 0

    def read(self, offset: int) -> int | None:
        """A register of the node; None if it is not one of these."""
        if offset == DEFINES["NODE_SCOPE_STATE"]:
            return self.phase | self.available << DEFINES["NODE_SCOPE_STATE_AVAILABLE_SHIFT"]
        if offset == DEFINES["NODE_SCOPE_WORD"]:
            assert self.available, "a word was read that is not there"
            self.taken += 1
            return self.recorded[self.taken - 1]
        return None

    def triggers(self, value: int) -> bool:
        """Whether this value of the signal of the trigger starts the recording."""
        level = signed(self.word[DEFINES["NODE_SCOPE_LEVEL"]], 32)
        above, before = value >= level, self.was_above
        self.was_above = above
        mode, modes = self.field("SCOPE_MODE"), TABLE["tick_trigger"]
        name = next((name for name, (code, _) in modes.items() if code == mode), None)
        return {
            "now": True,
            "rises": before is False and above,
            "falls": before is True and not above,
            "beyond": above or value <= -level,
            "bits": value & level != 0,
        }.get(name or "", False)

    @staticmethod
    def value(axis: "Axis", signal: int) -> int:
        """A signal of an axis now; these axes have no integral and no fine stage."""
        return (
            axis.word.get(DEFINES["AXIS_SAMPLE"], 0),
            axis.target,
            0,
            axis.speed,
            axis.error,
            signed(axis.word.get(DEFINES["AXIS_COMMAND"], 0) & 0xFFFF, 16),
            0,
            axis.position,
            axis.position & 0xFFFF,
            0,
            axis.faults,
        )[signal]

    def tick(self, axes: Sequence["Axis"]) -> None:
        """A servo tick has passed."""
        if self.phase not in (self.WAITING, self.RECORDING):
            return
        self.passed += 1
        if self.delay is not None:
            self.delay -= 1
            if self.delay > 0:
                return
        elif self.passed < self.field("SCOPE_SAMPLES_EVERY"):
            return
        self.passed = 0
        codes = (1 << DEFINES["NODE_SCOPE_LAST_WIDTH"]) * [0]
        for first in range(0, len(codes), 4):
            word = self.word.get(DEFINES[f"NODE_SCOPE_CHANNELS_{first}"], 0)
            codes[first : first + 4] = word.to_bytes(4, "little")
        chosen = codes[: self.field("SCOPE_LAST") + 1]
        sample = [self.value(axes[code >> 4 & 7], code & 15) & 0xFFFFFFFF for code in chosen]
        earlier, delay = self.field("SCOPE_PLACE_EARLIER"), self.field("SCOPE_PLACE_DELAY")
        seen = self.value(axes[self.field("SCOPE_AXIS")], self.field("SCOPE_TRIGGER"))
        hit = self.triggers(signed(seen & 0xFFFFFFFF, 32))
        if self.phase == self.WAITING and self.delay is None:
            ripe = len(self.samples) == earlier
            if not (hit and ripe and delay == 0):
                self.samples = [*self.samples, sample][-earlier:] if earlier else []
                self.delay = delay if hit and ripe else None
                return
        if self.phase == self.WAITING:
            self.recorded = [word for old in self.samples for word in old]
            self.phase = self.RECORDING
            self.delay = None
        self.recorded += sample
        used, each = len(self.recorded) - self.taken, len(sample)
        length = self.field("SCOPE_SAMPLES_LENGTH")
        if used + each > self.size or length and len(self.recorded) >= length * each:
            self.phase = self.FULL


class FlashPort(Protocol):
    """The port of a serial core to its flash, behind the register map."""

    def read(self, offset: int) -> int:
        """A word of the port."""

    def write(self, offset: int, value: int) -> None:
        """Write a word of the port."""


class Peripherals(Protocol):
    """The devices behind the registers of the block `peripherals`."""

    def read(self, offset: int) -> int:
        """A register of the block."""

    def write(self, offset: int, value: int) -> None:
        """Write a register of the block."""

    def millisecond(self, machine: "CompiledNode") -> None:
        """A millisecond of the node has passed."""


class CompiledNode:
    """The compiled firmware with its registers in Python; request() talks to it as a host does."""

    def __init__(
        self,
        *axes: Axis,
        map_crc: int = DEFINES["MAP_CRC"],
        address: int = 2,
        image: str = "axis",
        peripherals: Peripherals | None = None,
        absent: Sequence[str] = (),
        flash: FlashPort | None = None,
        scope_words: int = 0,
    ) -> None:
        """Power up. `absent` names what is not built, as in the register axis.built; a
        `map_crc` other than that of the firmware is a bitstream that does not fit it. A node with
        a `flash` has the serial core. `scope_words` is the memory of its recorder of ticks.
        """
        self.axes, self.address, self.map_crc, self.clk = (
            list(axes) or [Axis()],
            address,
            map_crc,
            0,
        )
        self.built = 2 << DEFINES["AXIS_BUILT_FILTERS_SHIFT"] | sum(
            mask
            for name, mask in DEFINES.items()
            if re.fullmatch(r"AXIS_BUILT_(?!FILTERS)\w+_MASK", name)
        )
        for name in absent:
            self.built &= ~DEFINES[f"AXIS_BUILT_{name.upper()}_MASK"]
        self.feedback_channels = [FeedbackChannel() for _ in self.axes]
        self.actuators: list[dict[int, int]] = [{} for _ in self.axes]  # words by their offset
        self.peripherals, self.flash, self.scope = peripherals, flash, TickScope(scope_words)
        self.received: deque[int] = deque()
        self.sent: list[int] = []
        self.word: dict[int, int] = {}
        self.link: dict[int, int] = {}  # registers of the real-time link by their offsets
        self.crc_bytes = b""
        self.sequence = 0
        self.answers = (
            READ(self.read),
            WRITE(self.write),
        )  # kept alive as long as the firmware may call
        self.firmware = power_up(image, self, update=bool(flash))
        self.firmware.register_bridge(*self.answers)
        self.firmware.firmware_start()

    def read(self, offset: int) -> int:
        """A register, as the firmware reads it."""
        d = DEFINES
        if offset >= END_OF_MAP:
            return self.flash.read(offset - END_OF_MAP) if self.flash else 0
        if offset >= d["ACTUATOR_BASE"]:
            return self.actuators[(offset - d["ACTUATOR_BASE"]) // d["ACTUATOR_STRIDE"]].get(
                offset % d["ACTUATOR_STRIDE"], 0
            )
        if offset >= d["FEEDBACK_BASE"]:
            return self.feedback_channels[
                (offset - d["FEEDBACK_BASE"]) // d["FEEDBACK_STRIDE"]
            ].read(offset % d["FEEDBACK_STRIDE"])
        if offset >= d["AXIS_BASE"]:
            axis = (offset - d["AXIS_BASE"]) // d["AXIS_STRIDE"]
            if offset % d["AXIS_STRIDE"] == d["AXIS_BUILT"]:
                return self.built
            return self.axes[axis].read(offset % d["AXIS_STRIDE"])
        if offset >= d["LINK_BASE"]:
            return self.link.get(offset - d["LINK_BASE"], 0)
        if offset >= d["PERIPHERALS_BASE"]:
            return self.peripherals.read(offset - d["PERIPHERALS_BASE"]) if self.peripherals else 0
        if offset >= d["BUS_BASE"]:
            offset -= d["BUS_BASE"]
            if offset == d["BUS_RECEIVE"]:
                return (
                    self.received.popleft() | d["BUS_RECEIVE_PRESENT_MASK"] if self.received else 0
                )
            if offset == d["BUS_STATE"]:
                return 128
            if offset == d["BUS_CRC"]:
                return zlib.crc32(self.crc_bytes)
            return self.word.get(d["BUS_BASE"] + offset, 0)
        live = self.scope.read(offset)
        if live is not None:
            return live
        build = (
            len(self.axes)
            | self.address << 4
            | 64 << 8
            | self.scope.size // 256 << d["NODE_BUILD_SCOPE_SHIFT"]
        )
        return {
            d["NODE_MAP_CRC"]: self.map_crc,
            d["NODE_CLK_HZ"]: CLK_HZ,
            d["NODE_BUILD"]: build,
            d["NODE_TIME_STAMP_LOW"]: self.clk & 0xFFFFFFFF,
            d["NODE_TIME_STAMP_HIGH"]: self.clk >> 32,
        }.get(offset, self.word.get(offset, 0))

    def write(self, offset: int, value: int) -> None:
        """Write a register, as the firmware does."""
        d = DEFINES
        if offset >= END_OF_MAP:
            if self.flash:
                self.flash.write(offset - END_OF_MAP, value)
        elif offset >= d["ACTUATOR_BASE"]:
            self.actuators[(offset - d["ACTUATOR_BASE"]) // d["ACTUATOR_STRIDE"]][
                offset % d["ACTUATOR_STRIDE"]
            ] = value
        elif offset >= d["FEEDBACK_BASE"]:
            axis = (offset - d["FEEDBACK_BASE"]) // d["FEEDBACK_STRIDE"]
            offset %= d["FEEDBACK_STRIDE"]
            self.feedback_channels[axis].write(offset, value)
            if offset == d["FEEDBACK_ALIGN"]:
                self.axes[axis].origin += signed(value & 7, 3) * (PERIOD // 4)
            if offset == d["FEEDBACK_STROBES"] and value & d["FEEDBACK_STROBES_CAPTURE_NOW_MASK"]:
                self.feedback_channels[axis].capture(SOFTWARE, self.clk, self.axes[axis].position)
        elif offset >= d["AXIS_BASE"]:
            self.axes[(offset - d["AXIS_BASE"]) // d["AXIS_STRIDE"]].write(
                offset % d["AXIS_STRIDE"], value
            )
        elif offset >= d["LINK_BASE"]:
            self.link[offset - d["LINK_BASE"]] = value
        elif offset >= d["PERIPHERALS_BASE"]:
            if self.peripherals:
                self.peripherals.write(offset - d["PERIPHERALS_BASE"], value)
        elif offset == d["BUS_BASE"] + d["BUS_TRANSMIT"]:
            self.sent.append(value)
        elif offset == d["BUS_BASE"] + d["BUS_CRC_START"]:
            self.crc_bytes = b""
        elif offset == d["BUS_BASE"] + d["BUS_CRC_BYTE"]:
            self.crc_bytes += bytes([value])
        else:
            self.word[offset] = value
            self.scope.write(offset, value)
            if offset == d["NODE_START_AXES"]:
                self.start_axes(value)

    def start_axes(self, mask: int) -> None:
        """Start the segments that wait in the players of these axes (bit n: axis n)."""
        for n, axis in enumerate(self.axes):
            axis.player.moving |= bool(mask >> n & 1 and axis.player.queue)

    def sync(self) -> None:
        """The sync pulse of the bus: prepared axes start, positions are captured."""
        d = DEFINES
        self.word[d["BUS_BASE"] + d["BUS_SYNCS"]] = 1 + self.word.get(
            d["BUS_BASE"] + d["BUS_SYNCS"], 0
        )
        self.start_axes(self.word.get(d["BUS_BASE"] + d["BUS_SYNC_AXES"], 0))
        for axis, channel in zip(self.axes, self.feedback_channels, strict=True):
            channel.capture(SOFTWARE, self.clk, axis.position)

    def poll(self, times: int = 1) -> None:
        """Poll the firmware so often, without time passing."""
        for _ in range(times):
            self.firmware.firmware_poll()

    def run(self, ms: float, until: Callable[[], object] | None = None) -> bool:
        """Run for `ms`: a poll of the firmware each millisecond, after four servo ticks. Stops
        early and returns True once `until` is true.
        """
        for _ in range(int(ms)):
            for _ in range(4):
                for axis, channel in zip(self.axes, self.feedback_channels, strict=True):
                    axis.tick()
                    if axis.passed is not None:
                        channel.index(self.clk, axis.passed)
                self.scope.tick(self.axes)
            self.clk += CLK_HZ // 1000
            if self.peripherals:
                self.peripherals.millisecond(self)
            self.poll()
            if until and until():
                return True
        return False

    def receive(self, words: Sequence[int]) -> bytes:
        """Put words on the bus; returns what the node sends."""
        self.sent.clear()
        for n in range(0, len(words), 8):
            self.received.extend(words[n : n + 8])
            self.poll()
        return bytes(self.sent)

    def frame(self, body: bytes, command: int | None = None) -> list[int]:
        """The words of a good frame, as the hardware passes them to the firmware."""
        command = 0x20 | self.address if command is None else command
        payload = bytes([len(body)]) + body
        payload += zlib.crc32(bytes([command]) + payload).to_bytes(4, "little")
        words = [command | DEFINES["BUS_RECEIVE_COMMAND_MASK"], *payload]
        words[-1] |= DEFINES["BUS_RECEIVE_GOOD_MASK"]
        return words

    def send(self, body: bytes) -> None:
        """Send a request, which the node must acknowledge."""
        assert self.receive(self.frame(body)) == bytes([0x60 | self.address])

    def reply(self) -> bytes:
        """The body that the node sends when it is asked for its reply."""
        ready = 0x50 | self.address
        sent = self.receive([0x10 | self.address | DEFINES["BUS_RECEIVE_COMMAND_MASK"]])
        assert sent[0] == ready and len(sent) == sent[1] + 6
        assert zlib.crc32(sent[:-4]) == int.from_bytes(sent[-4:], "little")
        return sent[2:-4]

    def request(self, name: str, **values: int) -> tuple[str, dict[str, int]]:
        """Do an operation of bus.toml; returns its cause and, if ok, the fields of the reply."""
        operation = TABLE["operation"][name]
        self.sequence = (self.sequence + 1) % 256
        body = bytes([self.sequence, operation["code"]])
        for declaration in operation["request"]:
            field, kind = declaration.split()
            body += values.pop(field).to_bytes(int(kind[1:]) // 8, "little", signed=kind[0] == "i")
        assert not values
        self.send(body)
        answer = self.reply()
        assert answer[:2] == body[:2]
        cause = CAUSE[answer[2]]
        if cause != "ok":
            assert len(answer) == 3, "a refusal has no fields"
            return cause, {}
        return cause, fields(operation["reply"], answer[3:])

    def ask(self, name: str, **values: int) -> dict[str, int]:
        """The same; the cause must be ok. Returns the fields."""
        cause, answer = self.request(name, **values)
        assert cause == "ok", cause
        return answer

    def status(self, axis: int = 0) -> dict[str, Any]:
        """The reply to `status`, with the names of state, cause and flags."""
        answer = self.ask("status", axis=axis)
        return {
            **answer,
            "state": STATE[answer["state"]],
            "ended": CAUSE[answer["ended"]],
            "flags": {name for name, bit in FLAG.items() if answer["flags"] & bit},
        }

    def set(self, axis: int = 0, **values: int) -> None:
        """Set parameters of an axis by their names, in their LSB."""
        for name, value in values.items():
            self.ask("set_parameter", axis=axis, parameter=PARAMETER[name]["id"], value=value)

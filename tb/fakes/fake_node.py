# SPDX-License-Identifier: Apache-2.0
"""A node in Python, and a bus to it that can damage words.

It was written from docs/protocol.md, and shares no code with the host except the made tables.
"""

import binascii
import random
from functools import reduce
from itertools import chain
from math import inf
from operator import and_

from moire.bus.transport import BAUD, Transport
from moire.made.bus_tables import (
    CAUSES,
    OPERATIONS,
    PARAMETERS,
    PROTOCOL_CRC,
    SCOPE_STATES,
    STATES,
)
from moire.made.registers import MAP_CRC

CAUSE = {name: code for code, (name, _) in CAUSES.items()}
STATE = {name: code for code, (name, _) in STATES.items()}
SCOPE_STATE = {name: code for code, (name, _) in SCOPE_STATES.items()}
SIZE = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "i64": 8, "u64": 8}
TICK_HZ, CLK_HZ = 4000, 4_000_000
LIMIT_LOW, ESTOP = 1 << 0, 1 << 2


def bytes_of(value, kind):
    """The bytes of a field."""
    return value.to_bytes(SIZE[kind], "little", signed=kind.startswith("i"))


class FakeAxis:
    """An axis that reaches every target, at a constant speed."""

    def __init__(self):
        self.parameters = {known.id: known.default for known in PARAMETERS.values()}
        self.enabled = self.homed = False
        self.faults = self.active_faults = self.events = 0
        self.position = self.target = 123456
        self.begin, self.until, self.stop_until = 0.0, 0.0, None
        self.kind, self.ended, self.end_cause = None, "no_motion_yet", "ok"
        self.writes = []
        self.calibration_state = dict(
            reason=1, converged=0, frozen=1, accepted=0, refused=0, scatter=0
        )
        self.moves_to_calibrate = 4  # moves until the calibration has converged; None: never
        self.correction = dict(sin_offset=0, cos_offset=0, gain=65536, quadrature_error=0)
        self.harmonics = {order: (0, 0) for order in range(1, 11)}
        self.waiting = dict(self.harmonics)
        self.signal = dict(faults=0, first=0)
        self.points = []  # of the segment table, in counts
        self.speeds = []  # of moves, period/s
        self.full_speed_s = 0.0  # what remains of a paused motion, at full speed

    def advance(self, now):
        """Continues the motion up to this time."""
        if self.active_faults and self.enabled:
            self.faults |= self.active_faults
            self.enabled = False
            if self.kind:
                self.kind, self.ended = None, "ended_by_fault"
        if self.kind and now >= self.until:
            if self.kind == "homing":
                self.homed = self.end_cause == "ok"
            if self.kind != "stopping" and self.end_cause == "ok":
                self.position = self.target
            self.target = self.position
            self.ended = "stopped" if self.kind == "stopping" else self.end_cause
            self.kind = None
        elif self.kind in ("moving", "homing"):
            share = (now - self.begin) / (self.until - self.begin)
            self.position = round(self.start + share * (self.target - self.start))
            self.begin, self.start = now, self.position

    @property
    def override(self):
        return self.parameters[67] / 65536

    def go(self, kind, now, seconds, target=None):
        """Begins a motion that takes this time at full speed."""
        self.kind, self.begin, self.ended = kind, now, "running"
        self.start, self.target = self.position, self.target if target is None else target
        self.full_speed_s = seconds
        self.until = now + seconds / self.override if self.override else inf

    def change_override(self, now, value):
        """Changes the feed override, also during a motion."""
        if self.override:
            self.full_speed_s = (self.until - now) * self.override
        self.parameters[67] = value
        self.until = now + self.full_speed_s / self.override if self.override else inf

    @property
    def state(self):
        if self.faults:
            return "faulted"
        return self.kind or ("holding" if self.enabled else "off")


class FakeNode:
    """A node with its bus interface and its firmware."""

    def __init__(self, address=1, axes=1, map_crc=MAP_CRC, protocol_crc=PROTOCOL_CRC, sine=True):
        self.address, self.map_crc, self.protocol_crc = address, map_crc, protocol_crc
        self.axes = [FakeAxis() for _ in range(axes)]
        self.sine = sine
        self.now, self.registers = 0.0, {0: map_crc, 0x400: 7}
        self.written = []  # (address, value)
        self.captures = []  # words of captured, captured_time and captured_position, oldest first
        self.expecting, self.payload = None, []
        self.baud = self.next_baud = BAUD
        self.powered_up = 0.0  # time at which its time stamp was zero
        self.last, self.reply = None, bytes([0, 0, 0])
        self.counters = dict.fromkeys(
            (
                "frames_good",
                "frames_bad",
                "framing_errors",
                "start_glitches",
                "overruns",
                "repeated",
                "refused",
                "breaks",
                "transmit_timeouts",
                "syncs",
            ),
            0,
        )
        self.waiting_for_sync = 0  # mask of the axes that the next sync starts
        self.scope, self.armed, self.samples = (
            "empty",
            None,
            [],
        )  # samples: position, error, command, time
        self.executed = []  # names of the operations, without repetitions
        self.wrong_map = False
        self.most_segments = 0  # of a segment table; 0: it was not built
        self.damages_points = False

    # the bus

    def receive_word(self, word):
        """The words with which the node answers this one."""
        if word >> 8:
            if self.expecting and self.payload:
                self.counters["frames_bad"] += 1
            self.expecting, self.payload = None, []
            if word & 0xFF == 0x20 | self.address:
                self.expecting = word & 0xFF
                return [0x60 | self.address]
            if word & 0xFF == 0x20:
                self.expecting = 0x20
                return []
            if word & 0xFF == 0x10 | self.address:
                inside = bytes([0x50 | self.address, len(self.reply)]) + self.reply
                self.baud = self.next_baud  # after this reply has been sent
                return list(inside + binascii.crc32(inside).to_bytes(4, "little"))
            return []
        if self.expecting is None:
            return []
        self.payload.append(word)
        length = self.payload[0]
        if not 1 <= length <= 64:
            self.counters["frames_bad"] += 1
            self.expecting = None
        elif len(self.payload) == length + 5:
            self.frame(bytes(self.payload))
            self.expecting = None
        return []

    def frame(self, payload):
        inside, crc = payload[:-4], payload[-4:]
        if binascii.crc32(bytes([self.expecting]) + inside).to_bytes(4, "little") != crc:
            self.counters["frames_bad"] += 1
            return
        self.counters["frames_good"] += 1
        if self.expecting == 0x20:
            self.counters["syncs"] += 1
            self.do_start(None, self.waiting_for_sync)
            self.waiting_for_sync = 0
            return
        if self.last == (inside[1], crc):
            self.counters["repeated"] += 1
            return
        self.last = (inside[1], crc)
        self.next_baud = self.baud  # unless this request is another set_baud
        self.reply = self.execute(inside[1:])

    # the firmware

    def execute(self, body):
        sequence, code = body[0], body[1]
        operation = next((known for known in OPERATIONS.values() if known.code == code), None)
        cause, fields = "unknown_operation", {}
        if operation:
            self.executed.append(operation.name)
            values, offset = {}, 2
            for name, kind in operation.request:
                values[name] = int.from_bytes(
                    body[offset : offset + SIZE[kind]], "little", signed=kind.startswith("i")
                )
                offset += SIZE[kind]
            if offset != len(body):
                cause = "wrong_length"
            elif self.wrong_map and operation.name != "identify":
                cause = "wrong_map"
            elif values.get("axis", 0) >= len(self.axes):
                cause = "no_such_axis"
            else:
                axis = self.axes[values.pop("axis", 0)]
                axis.advance(self.now)
                cause, fields = getattr(self, "do_" + operation.name)(axis, **values)
        if cause != "ok":
            self.counters["refused"] += 1
            return bytes([sequence, code, CAUSE[cause]])
        return bytes([sequence, code, 0]) + b"".join(
            bytes_of(fields[name], kind) for name, kind in operation.reply
        )

    def do_identify(self, _):
        return "ok", dict(
            map_crc=self.map_crc,
            protocol_crc=self.protocol_crc,
            version=1,
            address=self.address,
            axes=len(self.axes),
            clk_hz=CLK_HZ,
            tick_hz=TICK_HZ,
            sample_hz=100000,
        )

    def do_status(self, axis):
        flags = (
            axis.enabled
            | axis.homed << 1
            | (axis.active_faults & LIMIT_LOW) << 2
            | bool(axis.active_faults & ESTOP) << 4
            | (axis.kind is None and axis.enabled) << 5
        )
        return "ok", dict(
            state=STATE[axis.state],
            ended=CAUSE[axis.ended],
            flags=flags,
            encoder_events=axis.events,
            faults=axis.faults,
            first_fault=axis.faults & -axis.faults,
            position=axis.position,
            target=axis.target,
            velocity=98304 if axis.kind == "moving" else 0,
            command=-16384 if axis.kind else 0,
            counts=axis.position * axis.parameters[2] >> 16,
        )

    def do_enable(self, axis, on):
        if on and axis.faults:
            return "faulted", {}
        axis.enabled = bool(on)
        if not on and axis.kind:
            axis.kind, axis.ended = None, "stopped"
        return "ok", {}

    def ready(self, axis):
        return (
            "faulted"
            if axis.faults
            else "not_enabled"
            if not axis.enabled
            else "busy"
            if axis.kind
            else "ok"
        )

    def do_home(self, axis):
        if self.ready(axis) != "ok":
            return self.ready(axis), {}
        axis.go("homing", self.now, 0.8, 0)
        return "ok", {}

    def motion_refusal(self, axis, target):
        if self.ready(axis) != "ok":
            return self.ready(axis)
        if not axis.homed:
            return "not_homed"
        return "ok" if axis.parameters[3] <= target <= axis.parameters[4] else "out_of_travel"

    def seconds(self, axis, target):
        return abs(target - axis.position) / 65536 / axis.parameters[5] + 0.05

    def do_prepare(self, axis, target):
        cause = self.motion_refusal(axis, target)
        if cause != "ok":
            return cause, {}
        axis.kind, axis.prepared, axis.until, axis.ended = "prepared", target, inf, "running"
        return "ok", {"duration_ticks": round(self.seconds(axis, target) * TICK_HZ)}

    def do_start(self, _, axes):
        if axes == 0 or axes >> len(self.axes):
            return "out_of_range", {}
        chosen = [axis for n, axis in enumerate(self.axes) if axes >> n & 1]
        if any(axis.kind != "prepared" for axis in chosen):
            return "not_prepared", {}
        for axis in chosen:
            axis.go("moving", self.now, self.seconds(axis, axis.prepared), axis.prepared)
        return "ok", {}

    def do_start_at_sync(self, _, axes):
        if any(axis.kind != "prepared" for n, axis in enumerate(self.axes) if axes >> n & 1):
            return "not_prepared", {}
        self.waiting_for_sync = axes
        return "ok", {}

    def do_set_baud(self, _, baud):
        if not 9600 <= baud <= 3_000_000:
            return "out_of_range", {}
        self.next_baud = baud
        return "ok", {}

    def do_move(self, axis, target):
        if (cause := self.motion_refusal(axis, target)) != "ok":
            return cause, {}
        axis.speeds.append(axis.parameters[5])
        if not axis.calibration_state["frozen"] and axis.moves_to_calibrate is not None:
            axis.moves_to_calibrate -= 1
            if axis.moves_to_calibrate == 0:
                axis.calibration_state.update(converged=1, accepted=2, scatter=26)
        seconds = self.seconds(axis, target)
        axis.go("moving", self.now, seconds, target)
        return "ok", {"duration_ticks": round(seconds * TICK_HZ)}

    def do_stop(self, axis):
        if not axis.enabled:
            return "not_enabled", {}
        if axis.kind and axis.kind != "stopping":
            axis.go("stopping", self.now, 0.1)
        return "ok", {}

    def do_reset_faults(self, axis):
        if axis.active_faults:
            return "fault_persists", {}
        axis.faults = 0
        return "ok", {}

    def do_get_parameter(self, axis, parameter):
        return (
            ("ok", {"value": axis.parameters[parameter]})
            if parameter in axis.parameters
            else ("unknown_parameter", {})
        )

    def do_set_parameter(self, axis, parameter, value):
        known = next((known for known in PARAMETERS.values() if known.id == parameter), None)
        if known is None:
            return "unknown_parameter", {}
        if axis.kind and known.name != "feed_override":
            return "busy", {}
        if not known.min <= value <= known.max:
            return "out_of_range", {}
        if known.name == "feed_override":
            axis.change_override(self.now, value)
        axis.parameters[parameter] = value
        axis.writes.append(known.name)
        return "ok", {}

    def do_counters(self, _):
        return "ok", self.counters

    def do_encoder(self, axis):
        return "ok", dict(
            sin=-100,
            cos=27,
            phase=axis.position & 0xFFFF,
            amplitude=103,
            quadrature_count=-4,
            rejected_pulses=1,
            rejected_samples=2,
            home_phase=-16384,
            fault_position=65536,
        )

    def do_calibration(self, axis, action):
        if action > 3:
            return "out_of_range", {}
        if action in (1, 2):
            axis.calibration_state.update(frozen=action - 1, reason=action - 1)
        if action == 3:
            axis.calibration_state.update(converged=0)
        return "ok", axis.calibration_state

    def do_get_correction(self, axis):
        return "ok", axis.correction

    def do_get_harmonic(self, axis, order):
        return "ok", dict(zip(("cosine", "sine"), axis.harmonics[order]))

    def do_set_harmonic(self, axis, order, cosine, sine):
        if max(abs(cosine), abs(sine)) > 2 << 20:
            return "out_of_range", {}
        axis.waiting[order] = cosine, sine
        return "ok", {}

    def do_set_correction(self, axis, apply, **values):
        if not 32768 <= values["gain"] < 131072:
            return "out_of_range", {}
        axis.correction, axis.harmonics = values, dict(axis.waiting)
        return "ok", {}

    def do_signal(self, axis):
        if not self.sine:
            return "not_built", {}
        return "ok", axis.signal

    def do_position(self, axis):
        return "ok", {"position": axis.position}

    def do_arm_scope(self, axis, **setting):
        if setting["amplitude"] and self.ready(axis) != "ok":
            return self.ready(axis), {}
        self.scope, self.armed = "full" if setting["trigger"] == 0 else "waiting", setting
        return "ok", {}

    def do_scope(self, _):
        if self.scope == "waiting" and any(axis.kind == "moving" for axis in self.axes):
            self.scope = "full"
        full = self.scope == "full"
        return "ok", dict(
            state=SCOPE_STATE[self.scope],
            count=len(self.samples) * full,
            before=self.armed["before"] if full else 0,
        )

    def do_read_scope(self, _, first):
        if first >= len(self.samples) or self.scope != "full":
            return "out_of_range", {}
        padded = self.samples[first : first + 5] + [(0, 0, 0, 0)] * 5
        return "ok", {
            f"{name}_{n}": padded[n][column]
            for n in range(5)
            for column, name in enumerate(("position", "error", "command", "time"))
        }

    def do_segments(self, axis):
        use, complete = axis.parameters[90], len(axis.points) > axis.parameters[87]
        reason = (
            "ok"
            if not use
            else "no_segments"
            if not complete
            else "ok"
            if axis.homed
            else "not_homed"
        )
        if not self.most_segments:
            return "not_built", {}
        return "ok", dict(
            loaded=len(axis.points), in_force=use if reason == "ok" else 0, reason=CAUSE[reason]
        )

    def do_set_segments(self, axis, border, points, **values):
        if not self.most_segments:
            return "not_built", {}
        if axis.parameters[90]:
            return "segments_in_use", {}
        if (
            border not in (0, len(axis.points))
            or points > 12
            or border + points > self.most_segments + 1
        ):
            return "out_of_range", {}
        axis.points = axis.points[:border] + list(values.values())[:points]
        return "ok", {}

    def do_get_segments(self, axis, border):
        points = [point + self.damages_points for point in axis.points[border : border + 12]]
        return "ok", {
            f"point_{n}": point for n, point in enumerate(points + [0] * (12 - len(points)))
        }

    def do_write_register(self, _, address, value):
        if not 0xC00 <= address < 0xD00:
            return "no_such_register", {}
        self.written.append((address, value))
        self.registers[address] = value
        if address == 0xC10 and value & 1 << 6:  # the oldest capture has been read
            self.captures.pop(0)
        return "ok", {}

    def do_read_register(self, _, address):
        if address == 0xC64:
            return "ok", {"value": bool(self.captures) | (self.registers.get(address, 0) & 64)}
        if self.captures and 0xC68 <= address < 0xC78:
            return "ok", {"value": self.captures[0][address - 0xC68 >> 2]}
        if address in (0xCB4, 0xCD4):  # state and error of the segment table
            return "ok", {"value": self.most_segments if address == 0xCB4 else 0xFFFFE000}
        if address & 0xFF == 0xA8 and 0xC00 <= address < 0x1400:  # position_source.sine
            return "ok", {"value": self.sine << 2}
        if 0x10 <= address < 0x18:  # time stamp
            return "ok", {
                "value": round((self.now - self.powered_up) * CLK_HZ) >> 8 * (address - 0x10)
                & 0xFFFFFFFF
            }
        return (
            ("ok", {"value": self.registers[address]})
            if address in self.registers
            else ("no_such_register", {})
        )


class FakeBus(Transport):
    """Nodes on one bus. `to_node` and `from_node` change a word into a list of words, and so may
    damage, lose or repeat it.
    """

    time_is_stopped = True

    def __init__(self, *nodes):
        self.nodes, self.arrived, self.clock, self.closed = nodes, [], 0.0, False
        self.to_node = self.from_node = lambda word: [word]
        # true: words that several nodes send at once are combined by AND, as on a wire
        self.wired_and = False
        self.at = []  # (time, action) that happen at their times
        self.baud = BAUD

    def pass_time(self, seconds):
        self.clock += seconds
        for node in self.nodes:
            node.now = self.clock
            for axis in node.axes:
                axis.advance(self.clock)
        for due in [entry for entry in self.at if entry[0] <= self.clock]:
            self.at.remove(due)
            due[1]()

    def send(self, words):
        for word in words:
            self.pass_time(self.character_s)
            for received in self.to_node(word):
                answers = [
                    node.receive_word(received) if node.baud == self.baud else []
                    for node in self.nodes
                ]
                if self.wired_and:
                    answers = [[reduce(and_, several) for several in zip(*answers)]]
                for answer in chain(*answers):
                    self.arrived += self.from_node(answer)

    def receive(self, count, timeout_s):
        taken, self.arrived = self.arrived[:count], self.arrived[count:]
        self.pass_time(len(taken) * self.character_s if len(taken) == count else timeout_s)
        return taken

    def now(self):
        return self.clock

    def wait(self, seconds):
        self.pass_time(seconds)

    def set_baud(self, baud):
        super().set_baud(baud)
        self.baud = baud

    def send_break(self):
        for node in self.nodes:
            node.baud = node.next_baud = BAUD
            node.counters["breaks"] += 1

    def close(self):
        self.closed = True


def spoil(source: random.Random, share: float):
    """Makes a function that loses, damages or doubles this share of the words."""

    def change(word):
        if source.random() >= share:
            return [word]
        return source.choice(
            [[], [word ^ 1 << source.randrange(9)], [word, word], [source.randrange(512)]]
        )

    return change

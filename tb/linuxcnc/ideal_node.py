# SPDX-License-Identifier: Apache-2.0
"""A node with ideal axes behind its link: plays the registers that the driver for LinuxCNC reads
and writes. Each request that is acted upon takes one servo period of the node's time (lockstep), or
the time is that of a clock.
"""

import math
import socket
import struct
import threading
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache

from moire.made import link_tables as layout
from moire.made.bus_tables import CAUSES as BUS_CAUSES
from moire.made.bus_tables import FAULTS, STATES
from moire.made.registers import BLOCKS, FIELDS, MAP_CRC, Field

CLK_HZ = 2_400_000
TICK = 600  # cycles
PERIOD_CYCLES = 2400  # of a request in lockstep: 1 ms
FIRMWARE_CYCLES = 12_000  # between two looks of the firmware at the requests
POSITION_LSB = 1 << 16  # per period
VELOCITY_LSB = 1 << 24  # per period and tick
WORD = 1 << 32
STATE = {name: code for code, (name, _) in STATES.items()}
FAULT = {name: 1 << bit for bit, (name, _) in FAULTS.items()}
CAUSE = {name: code for code, (name, _) in BUS_CAUSES.items()}
OFF, PREPARED, STREAMING, EXTRAPOLATING, ENDED = range(5)
NOT_ENDED, RELEASED, STOPPED, LATE, BY_FAULT = range(5)
LOST = b"?"  # instead of a reply
SLOWING = 0.9  # of the velocity that is left after each tick of a controlled stop
STILL = 1e-3  # periods per tick
FARTHEST, PIECES = 255, 16  # ticks until a set-point, and set-points that wait
INDEX, RISING, FALLING = 1, 8, 32  # sources of captures


@cache
def address(block: str, register: str, axis: int = 0) -> int:
    """The byte address of the low word of a register."""
    base, stride = BLOCKS[block]
    offset = next(f.offset for f in FIELDS if (f.block, f.register) == (block, register))
    return base + axis * stride + offset


@cache
def field_of(block: str, register: str, name: str) -> Field:
    """A field of a register."""
    return next(f for f in FIELDS if (f.block, f.register, f.field) == (block, register, name))


def placed(block: str, register: str, **values: int) -> int:
    """The word of a register with these fields."""
    word = 0
    for name, value in values.items():
        found = field_of(block, register, name)
        word |= (value & (1 << found.width) - 1) << found.low
    return word


def signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) & 1 else value


@dataclass
class SetPoint:
    """Where an axis is to be at a tick: periods, and periods per tick."""

    tick: int
    position: float
    velocity: float

    def later(self, ticks: float) -> "SetPoint":
        """At constant velocity."""
        return SetPoint(self.tick + math.ceil(ticks), self.position + self.velocity * ticks, 0)


def between(a: SetPoint, b: SetPoint, tick: float) -> float:
    """The position of the cubic through two set-points."""
    ticks = b.tick - a.tick
    u = (tick - a.tick) / ticks
    h00, h10 = (1 + 2 * u) * (1 - u) ** 2, u * (1 - u) ** 2
    h01, h11 = u * u * (3 - 2 * u), u * u * (u - 1)
    return h00 * a.position + h01 * b.position + ticks * (h10 * a.velocity + h11 * b.velocity)


@dataclass
class IdealAxis:
    """An axis that is where its target is."""

    position: float = 1000.0  # periods, from the zero that it does not know yet
    enabled: bool = False
    homed: bool = False
    state: int = STATE["off"]
    faults: int = 0
    first_fault: int = 0
    requested: dict[str, int] = field(
        default_factory=lambda: {"enable": 0, "home": 0, "stream": 0, "reset_faults": 0}
    )
    mode: int = OFF
    ended: int = NOT_ENDED
    queue: list[SetPoint] = field(default_factory=list)
    done: SetPoint | None = None
    fresh: set[str] = field(default_factory=set)
    accepted: int = 0
    late: int = 0
    refused: int = 0
    extrapolated: int = 0
    home_ticks: int = 0  # until homing ends
    velocity: float = 0.0
    turn: float = 0.0  # an encoder without a drive: periods from index to index
    spin: float = 0.0  # and periods per tick
    sources: int = 0  # of captures
    captured: list[float] = field(default_factory=list)
    beside: float = 0.0  # of its target, in periods: a side of a gantry that does not follow
    cuts: list[float] = field(default_factory=list)  # velocities at which the drive went off

    def switch_off(self, state: str) -> None:
        """The drive goes off."""
        if self.enabled:
            self.cuts.append(self.velocity)
        self.enabled, self.state = False, STATE[state]

    def fault(self, name: str) -> None:
        """Latches a fault: the drive goes off."""
        self.first_fault = self.first_fault or FAULT[name]
        self.faults |= FAULT[name]
        self.switch_off("faulted")
        if self.mode not in (OFF, ENDED):
            self.mode, self.ended = ENDED, BY_FAULT

    def obey(self, asked: dict[str, int], tick: int) -> None:
        """What the firmware does at each look at the requests."""
        rose = {name: asked[name] and not self.requested[name] for name in asked}
        fell = {name: self.requested[name] and not asked[name] for name in asked}
        self.requested = asked
        if rose["reset_faults"] and not self.enabled:
            self.faults = self.first_fault = 0
            self.state = STATE["off"]
        if rose["enable"] and not self.faults:
            self.enabled, self.state = True, STATE["holding"]
        if not asked["enable"] and self.enabled:
            self.switch_off("off")
            if self.mode not in (OFF, ENDED):
                self.mode, self.ended = ENDED, STOPPED
        if rose["home"] and self.state == STATE["holding"] and self.mode == OFF:
            self.homed, self.state, self.home_ticks = False, STATE["homing"], 800
        if fell["home"] and self.state == STATE["homing"]:
            self.state = STATE["stopping"]
        if rose["stream"] and self.state == STATE["holding"] and self.homed:
            self.mode, self.ended, self.queue = PREPARED, NOT_ENDED, []
            self.state = STATE["prepared"]
            self.done = SetPoint(tick, self.position, 0)
            self.accepted = self.late = self.refused = self.extrapolated = 0
        if not asked["stream"]:
            if self.mode in (PREPARED, STREAMING, EXTRAPOLATING):
                self.state = STATE["stopping"]
            self.mode = OFF

    def commit(self, point: SetPoint, tick: int) -> None:
        """Queues a set-point."""
        complete, self.fresh = self.fresh == {"position", "velocity"}, set()
        last = self.queue[-1] if self.queue else None
        if self.mode not in (PREPARED, STREAMING, EXTRAPOLATING) or not complete:
            self.refused += 1
        elif point.tick > tick + FARTHEST or len(self.queue) == PIECES:
            self.refused += 1
        elif point.tick <= tick + 4 or (last and point.tick < last.tick + 2):
            self.late += 1
        else:
            self.accepted += 1
            if self.mode == PREPARED:
                self.done = SetPoint(tick, self.position, 0)
            self.mode, self.state = STREAMING, STATE["moving"]
            self.queue.append(point)

    def capture(self, source: int, position: float) -> None:
        """An event at a position."""
        if self.sources & source:
            self.captured.append(position)

    def run(self, tick: int, late_limit: int) -> None:
        """A servo tick."""
        before = self.position
        self.position += self.spin
        if self.turn and self.position // self.turn != before // self.turn:
            self.capture(INDEX, self.position // self.turn * self.turn)
        if self.state == STATE["homing"]:
            self.home_ticks -= 1
            self.position -= self.position / max(1, self.home_ticks)
            if self.home_ticks <= 0:
                self.homed, self.state, self.position = True, STATE["holding"], 0.0
        if self.mode in (STREAMING, EXTRAPOLATING) and self.done:
            while self.queue and self.queue[0].tick <= tick:
                self.done = self.queue.pop(0)
            if self.queue:
                self.mode = STREAMING
                self.position = between(self.done, self.queue[0], tick)
            else:
                if tick > self.done.tick:
                    self.mode = EXTRAPOLATING
                    self.extrapolated += 1
                self.position = self.done.position + self.done.velocity * (tick - self.done.tick)
                if tick - self.done.tick > late_limit:
                    self.mode, self.ended, self.state = ENDED, LATE, STATE["stopping"]
        elif self.state == STATE["stopping"]:
            self.position += SLOWING * self.velocity if self.enabled else 0
            if abs(self.velocity) < STILL:
                self.state = STATE["holding"]
        self.velocity = self.position - before


CLEARS = placed("feedback", "strobes", capture_clear=1, arm_index=1)


class IdealNode:
    """A node with `axes` ideal axes and its link. `spindle` is an encoder after them. `above` is
    the height of the tip of a touch probe over a surface, in periods, by the positions of the axes:
    it is linear within a tick. With `has_pll` its link has a PLL, locked at once if the set-up asks
    for captures.
    """

    address = 1  # on the bus

    def __init__(
        self,
        axes: int,
        map_crc: int = MAP_CRC,
        spindle: IdealAxis | None = None,
        above: Callable[[Sequence[float]], float] = lambda positions: 1.0,
        has_pll: bool = False,
    ) -> None:
        self.axes = [IdealAxis() for _ in range(axes)] + ([spindle] if spindle else [])
        self.drives, self.above, self.height = axes, above, 1.0
        self.map_crc = map_crc
        self.time = 0  # cycles
        self.tick = 0
        self.estop = False
        self.pressed_at = self.heard_at = 0  # cycles
        self.session, self.sequence, self.bit_time = 0, 0, 0
        self.watchdog_s = 0.0  # of the link; 0: none
        self.lists: dict[int, int] = {}
        self.writes, self.reads, self.entry, self.drawn = 0, 0, 0, 0
        self.refused = [0] * len(layout.CAUSES)
        self.has_pll, self.period, self.lead = has_pll, 0, 0  # of the link; cycles
        self.captured: list[int] | None = None  # the values of the next reply; None: not captured
        self.captures = False  # whether the read list is being read for that
        self.read_time = 0  # cycles
        self.words: dict[int, int] = {}
        self.path: list[tuple[float, ...]] = []  # each ms of a stream: time, positions
        self.names: dict[int, Callable[[], int]] = {}
        self._name_registers()

    # ---- registers

    def _name_registers(self) -> None:
        names = self.names
        names[address("node", "map_crc")] = lambda: self.map_crc
        names[address("node", "build")] = lambda: placed("node", "build", axes=len(self.axes))
        names[address("node", "clk_hz")] = lambda: CLK_HZ
        names[address("node", "tick_period")] = lambda: TICK
        names[address("node", "tick_count")] = lambda: self.tick % WORD
        names[address("link", "read_time")] = lambda: self.read_time % WORD * self.has_pll
        names[address("link", "pll_state")] = lambda: placed(
            "link",
            "pll_state",
            built=self.has_pll,
            locked=self.locked,
            captured=self.captures,
        )
        for n, axis in enumerate(self.axes):

            def wide(
                register: str, value: Callable[[], float], n: int = n, block: str = "axis"
            ) -> None:
                low = address(block, register, n)
                names[low] = lambda: round(value() * POSITION_LSB) % WORD
                names[low + 4] = lambda: round(value() * POSITION_LSB) >> 32 & WORD - 1

            wide("position", lambda axis=axis: axis.position + axis.beside)
            wide("target", lambda axis=axis: axis.position)
            wide("captured_position", lambda axis=axis: axis.captured[0], block="feedback")
            drive = n < self.drives
            names[address("axis", "built", n)] = lambda drive=drive: placed(
                "axis", "built", set_points=drive, drive=drive, capture=1
            )
            names[address("axis", "state", n)] = lambda axis=axis: placed(
                "axis", "state", enabled=axis.enabled, estop=self.estop, probe=self.height < 0
            )
            names[address("feedback", "capture_state", n)] = lambda axis=axis: placed(
                "feedback", "capture_state", present=bool(axis.captured)
            )
            names[address("axis", "faults", n)] = lambda axis=axis: axis.faults
            names[address("axis", "first_fault", n)] = lambda axis=axis: axis.first_fault
            names[address("axis", "velocity", n)] = lambda axis=axis: (
                round(axis.velocity * POSITION_LSB) % WORD
            )
            names[address("axis", "stream_state", n)] = lambda axis=axis: placed(
                "axis",
                "stream_state",
                mode=axis.mode,
                ended=axis.ended,
                extrapolated=axis.extrapolated,
            )
            names[address("axis", "stream_counts", n)] = lambda axis=axis: placed(
                "axis",
                "stream_counts",
                accepted=axis.accepted,
                late=axis.late,
                refused=axis.refused,
            )
            names[address("axis", "supervision", n)] = lambda axis=axis: placed(
                "axis", "supervision", state=axis.state, homed=axis.homed
            )

    def read(self, at: int) -> int:
        return self.names[at]() if at in self.names else self.words.get(at, 0)

    def write(self, at: int, value: int) -> None:
        self.words[at] = value
        for n, axis in enumerate(self.axes):
            if at == address("axis", "set_point_position", n) + 4:
                axis.fresh.add("position")
            if at == address("axis", "set_point_velocity", n):
                axis.fresh.add("velocity")
            if at == address("feedback", "capture_sources", n):
                axis.sources = value
            if at == address("feedback", "strobes", n) and value == CLEARS:
                axis.captured = []
        if at == address("node", "set_point_commit"):
            self._commit(value)

    def _commit(self, mask: int) -> None:
        tick = self.words[address("node", "set_point_tick")]
        tick = self.tick + signed((tick - self.tick) % WORD, 32)
        for n, axis in enumerate(self.axes):
            if mask >> n & 1:
                low = address("axis", "set_point_position", n)
                position = signed(self.words[low] | self.words[low + 4] << 32, 64) / POSITION_LSB
                velocity = signed(self.words[address("axis", "set_point_velocity", n)], 32)
                axis.commit(SetPoint(tick, position, velocity / VELOCITY_LSB), self.tick)

    # ---- time

    def advance(self, cycles: int) -> None:
        """The node runs until the next request, and captures its values before."""
        end = self.time + cycles
        if self.locked:
            self._run(end - self.lead)
            self.captures = True
            self.captured = self._read_list()
            self.captures = False
        self._run(end)

    @property
    def locked(self) -> bool:
        return bool(self.session and self.period)

    def _read_list(self) -> list[int]:
        self.read_time = self.time
        return [self.read(self.lists[n] >> 16) for n in range(self.reads)]

    def _run(self, end: int) -> None:
        while (self.tick + 1) * TICK <= end:
            self.tick += 1
            self.time = self.tick * TICK
            if self.time % FIRMWARE_CYCLES == 0:
                requests = self.words.get(address("node", "axis_requests"), 0)
                for n, axis in enumerate(self.axes):
                    axis.obey(self._asked(requests, n), self.tick)
            if self.expired:
                for axis in [axis for axis in self.axes if axis.enabled]:
                    axis.fault("link_watchdog")
            before = [axis.position for axis in self.axes]
            for axis in self.axes:
                axis.run(self.tick, self.words.get(address("node", "late_limit"), 0))
            self._touch(before)
            self.path.append((self.time / CLK_HZ, *(axis.position for axis in self.axes)))
        self.time = end

    def _touch(self, before: Sequence[float]) -> None:
        """Captures the positions of all axes where the probe meets the surface or leaves it."""
        was, self.height = self.height, self.above([axis.position for axis in self.axes])
        if (was < 0) != (self.height < 0):
            share = was / (was - self.height)
            for axis, start in zip(self.axes, before, strict=True):
                at = start + share * (axis.position - start)
                axis.capture(RISING if self.height < 0 else FALLING, at)

    def _asked(self, requests: int, n: int) -> dict[str, int]:
        return {
            name: requests >> field_of("node", "axis_requests", name).low >> n & 1
            for name in ("enable", "home", "stream", "reset_faults")
        }

    def slip(self, axis: int, periods: float) -> None:
        """From now on an axis is beside its target."""
        self.axes[axis].beside = periods

    def press_estop(self, pressed: bool = True) -> None:
        """The emergency stop of the node."""
        self.estop, self.pressed_at = pressed, self.time
        for axis in self.axes if pressed else []:
            axis.fault("estop")

    @property
    def expired(self) -> bool:
        """Whether the watchdog of the link has expired."""
        return 0 < self.watchdog_s * CLK_HZ < self.time - self.heard_at

    def stopped_for(self, seconds: float) -> bool:
        """Whether the emergency stop has been pressed for so long."""
        return self.estop and self.time - self.pressed_at > seconds * CLK_HZ

    def unset_for(self, seconds: float) -> bool:
        """Whether the node has been without a set-up for so long since its power came."""
        return not self.session and self.time > seconds * CLK_HZ

    # ---- the link

    def answer(self, packet: bytes) -> bytes | None:
        """The reply to a request; None if it is refused."""
        words = struct.unpack(f"<{len(packet) // 4}I", packet) if len(packet) % 4 == 0 else ()
        if not words or zlib.crc32(packet[:-4]) != words[-1]:
            return self._refuse("damaged")
        if not self.session or words[0] != layout.KIND_REQUEST | self.session << 8:
            return self._refuse("foreign")
        if len(words) != layout.REQUEST_WORDS + self.writes + layout.REQUEST_END_WORDS + 1:
            return self._refuse("wrong_length")
        if not 0 < (words[1] - self.sequence) % WORD < WORD // 2:
            return self._refuse("replayed")
        self.sequence, self.heard_at = words[1], self.time
        identity = layout.KIND_REPLY | self.session << 8
        for n, value in enumerate(words[layout.REQUEST_WORDS : layout.REQUEST_WORDS + self.writes]):
            self.write(self.lists[n] & 0xFFFF, value)
        values = self._read_list() if self.captured is None else self.captured
        self.captured = None
        spare, spare_value = words[-3], words[-2]
        read = 0 if spare >> 31 else self.read(spare & 0xFFFF)
        if spare >> 31:
            self.write(spare & 0xFFFF, spare_value)
        counts = sum((count % 256) << 8 * n for n, count in enumerate(self.refused))
        content = [identity, words[1], self.time % WORD, counts % WORD, counts >> 32, *values, read]
        body = struct.pack(f"<{len(content)}I", *content)
        return body + zlib.crc32(body).to_bytes(4, "little")

    def restart(self) -> None:
        """The node loses its power and starts again."""
        self.session = self.sequence = self.time = self.tick = self.heard_at = 0
        self.words, self.captured, self.period, self.watchdog_s = {}, None, 0, 0.0
        self.refused = [0] * len(layout.CAUSES)
        for axis in self.axes:
            axis.__init__(position=axis.position, turn=axis.turn, spin=axis.spin)

    def _refuse(self, cause: str) -> None:
        names = [name for name, _ in layout.CAUSES]
        self.refused[names.index(cause)] += 1

    def write_named(self, name: str, axis: int = 0, **fields: int) -> None:
        """Writes a register as a client of the bus would: those of the link are the set-up."""
        if name == "link.lists":
            self.writes, self.reads = fields["writes"], fields["reads"]
        elif name == "link.entry":
            self.lists[self.entry] = fields["write"] | fields["read"] << 16
        elif name == "link.entry_number":
            self.entry = fields["value"]
        elif name == "link.pll_period":
            self.period = fields["value"]
        elif name == "link.capture_lead":
            self.lead = fields["value"]
        elif name == "link.session":
            self.drawn = fields["value"]
        elif name == "link.enable":
            self.session, self.sequence = self.drawn * fields["value"], 0
            self.heard_at, self.captured = self.time, None
        elif name == "link.watchdog_time":
            self.watchdog_s = 1e-3 * fields["value"]
        elif name == "link.bit_time":
            self.bit_time = fields["value"]
        elif not name.startswith("link."):
            block, _, register = name.partition(".")
            self.write(address(block, register, axis), fields["value"])

    def read_named(self, name: str, axis: int = 0) -> dict[str, int]:
        """Reads a register as a client of the bus would."""
        if name != "link.state":
            block, _, register = name.partition(".")
            known = [f for f in FIELDS if (f.block, f.register) == (block, register)]
            return {f.field: f.value(self.read(known[0].address(axis))) for f in known}
        on = self.session != 0
        return {"built": 1, "on": on, "expired": on and self.expired, "session": self.session}


class Served(threading.Thread):
    """A node behind a UDP socket of this machine, in lockstep: each request is a period of it.

    `events` are conditions with what happens once at the first request at which they are true. A
    packet is lost, either way, where `lose(node)` is true: then one byte is the answer.
    """

    def __init__(
        self,
        node: IdealNode,
        events: Sequence[tuple[Callable[[IdealNode], bool], Callable[[IdealNode], None]]] = (),
        lose: Callable[[IdealNode], bool] = lambda node: False,
    ) -> None:
        super().__init__(daemon=True)
        self.node, self.events, self.lose = node, list(events), lose
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.1)
        self.port = self.socket.getsockname()[1]
        self.ended = threading.Event()

    def run(self) -> None:
        while not self.ended.is_set():
            try:
                packet, host = self.socket.recvfrom(4096)
            except TimeoutError:
                continue
            for event in [event for event in self.events if event[0](self.node)]:
                self.events.remove(event)
                event[1](self.node)
            reply = None if self.lose(self.node) else self.node.answer(packet)
            self.node.advance(PERIOD_CYCLES)
            self.socket.sendto(reply or LOST, host)

    def __enter__(self) -> "Served":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self.join()
        self.socket.close()

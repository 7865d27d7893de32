# SPDX-License-Identifier: Apache-2.0
"""A simple axis of a node without hardware: its player, its drive and its interlock.

The player adds up the segments as they were pushed: without B-spline between their steps or limit
of jerk. A feed override leaves out ticks, and changes at once. A controlled stop takes
stop_deceleration off the velocity each tick, and a profile starts at full speed. What
rtl/control/motion_engine.sv does beyond this is tested with its own model, and with the RTL in
tb/system. Each tick the position moves by half the distance to the target; an axis whose drive is
off does not move, and it slides a little past a limit switch that has closed. Faults latch as
drive_interlock does it.
"""

from collections import deque
from collections.abc import Sequence

from twin.compiled.tables import DEFINES, FAULT, PERIOD, signed

FULL_SPEED = 1 << 16  # of the feed override
SLIDE = 30 * PERIOD  # past a closed switch
BACKLASH = PERIOD // 2  # a switch opens so far from where it closed
ALWAYS_LATCHED = FAULT["estop"] | FAULT["drive"] | FAULT["cpu"]


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
        self.stand()
        self.target = position << 24

    def stand(self) -> None:
        """Stand still at the target, without segments."""
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
            self.stand()
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

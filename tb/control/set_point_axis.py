# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/set_point_axis.sv in integers: clk(...) advances one cycle; the attributes
are the levels after it.
"""

OFF, PREPARED, STREAMING, EXTRAPOLATING, ENDED = range(5)  # modes
NOT_ENDED, RELEASED, STOPPED, ENDED_LATE, FAULT = range(5)
NONE, LATE, LIMITS, OUT_OF_TRAVEL, QUEUE_FULL, INCOMPLETE, NOT_STREAMED, TOO_FAR_AHEAD = range(8)
DEPTH = 16  # segments in the queue of the engine
HOLD, MARGIN = 6, 3  # ticks
STROBES = ("looked", "began", "pushed", "accepted", "extended", "released", "quits", "stopped")
LEVELS = (
    "begins",
    "active",
    "anchored",
    "started",
    "ending",
    "due",
    "stop_due",
    "full",
    "streamed",
    "ahead",
    "state",
    "counts",
)


class SetPointAxis:
    def __init__(self):
        self.reset()

    def reset(self):
        self.mode = self.ended = self.refusal = self.queued = self.ahead = 0
        self.starting = self.resting = self.due = self.stop_due = 0
        self.waiting = self.allowed = 0
        self.accepted = self.late = self.refused = self.extrapolated = 0

    @property
    def anchored(self):
        return int(self.mode in (PREPARED, STREAMING, EXTRAPOLATING))

    @property
    def active(self):
        return int(self.starting or self.anchored)

    @property
    def started(self):
        return int(self.mode in (STREAMING, EXTRAPOLATING))

    @property
    def ending(self):
        return int(self.ahead <= MARGIN)

    @property
    def full(self):
        return int(self.queued == DEPTH)

    @property
    def streamed(self):
        return int(self.active or self.stop_due)

    def begins(self, allowed):
        busy = self.mode != OFF or self.starting or self.stop_due
        return int(allowed and self.resting and not busy)

    def state(self, waiting):
        room = max(0, DEPTH - self.queued - waiting)
        return self.mode | self.ended << 3 | self.refusal << 6 | room << 9 | self.extrapolated << 16

    @property
    def counts(self):
        return self.accepted | self.late << 16 | self.refused << 24

    def levels(self, allowed, waiting):
        """All outputs, by name."""
        found = {name: getattr(self, name) for name in LEVELS if name not in ("begins", "state")}
        return found | dict(begins=self.begins(allowed), state=self.state(waiting))

    def clk(
        self,
        rst=0,
        tick=0,
        allowed=0,
        enabled=0,
        stops=0,
        state=None,
        ticks=0,
        reason=0,
        cause=None,
        dropped=0,
        strobes=(),
    ):
        """state: (moving, braking, queued) or None; cause: of a set-point that is refused, or None;
        strobes: names of STROBES that are high.
        """
        if rst:
            self.reset()
            return
        moving, braking, queued = state or (1, 0, 1)
        starting, mode, active = self.starting, self.mode, self.active
        fails = not enabled or stops or braking or (not moving and not starting)
        takes = starting and state and moving and queued == 0
        if state:
            self.queued, self.resting = queued, int(not moving and queued == 0)
        self.ahead += ("pushed" in strobes) * ticks - int(tick and self.ahead > 0)
        self.ahead %= 1 << 13
        self.accepted = (self.accepted + ("accepted" in strobes)) % (1 << 16)
        self.late = (self.late + (cause == LATE)) % 256
        self.refused = (self.refused + (cause not in (None, LATE)) + dropped) % 256
        if "extended" in strobes:
            self.extrapolated = (self.extrapolated + ticks) % (1 << 16)
        if cause is not None:
            self.refusal = cause
        if dropped:
            self.refusal = QUEUE_FULL
        if "looked" in strobes:
            self.due = 0
        if tick and (allowed or active or mode == ENDED):
            self.due = 1
        if "stopped" in strobes:
            self.stop_due = 0
        if mode == ENDED and not allowed:
            self.mode = OFF
        if "accepted" in strobes:
            self.mode = STREAMING
        if "extended" in strobes:
            self.mode = EXTRAPOLATING
        if "released" in strobes:
            self.mode, self.ended = OFF, RELEASED
        if takes:
            self.starting, self.mode, self.ahead = 0, PREPARED, HOLD
        if "began" in strobes:
            self.starting, self.ended, self.refusal = 1, NOT_ENDED, NONE
            self.accepted = self.late = self.refused = self.extrapolated = 0
        if "quits" in strobes or (active and fails):
            self.mode, self.starting, self.stop_due, self.due = ENDED, 0, 1, 1
            if "quits" in strobes and enabled:
                self.ended = reason
            else:
                self.ended = STOPPED if enabled and stops else FAULT

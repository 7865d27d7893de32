# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/set_point_player.sv in integers: offer() is what it offers to engine_bus in
this cycle, clk(...) then advances one cycle.
"""

from tb.control.set_point_axis import (
    ENDED_LATE,
    FAULT,
    HOLD,
    INCOMPLETE,
    LATE,
    LIMITS,
    NOT_STREAMED,
    OUT_OF_TRAVEL,
    QUEUE_FULL,
    STOPPED,
    TOO_FAR_AHEAD,
    SetPointAxis,
)
from tb.control.set_point_piece import SetPointPiece
from tb.control.set_point_queue import SetPointQueue

EXTENSION = 2  # ticks
LAST = 1 << 24  # of the ticks of a segment
PARTS = 4  # words of a piece
SHORTEST, LONGEST = 1, 255  # ticks of a piece to a set-point
READS = (0, 1, 4, 5, 6, 7)  # words of set_point_queue that a set-point needs
WRAP = 1 << 32


def signed(value, bits=32):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class SetPointPlayer:
    def __init__(self, axes, mask=255):
        self.count, self.mask = axes, mask
        self.queue, self.maker = SetPointQueue(axes), SetPointPiece()
        self.targets, self.ends = {}, {}  # of each axis; (position, velocity, ticks too late)
        self.reset()

    def reset(self):
        self.axes = [SetPointAxis() for _ in range(self.count)]
        self.phase, self.axis, self.scan, self.next_axis = "rest", 0, 0, 0
        self.tick_count = self.start = self.stop = self.powered = 0
        self.kind, self.words, self.reached = None, [], None  # the piece, and where it ends
        self.starts = self.fetched = self.ticks = 0
        self.computed = None

    def built(self, n):
        return self.mask >> n & 1

    def offer(self):
        """(axis, part, word) of the word that is offered, or None."""
        if self.phase != "offer" or not self.axes[self.axis].active:
            return None
        return self.axis, PARTS - len(self.words), self.words[0]

    def rests(self, n):
        return n in self.ends and -1 << 16 <= self.ends[n][1] < 1 << 16

    def look(self, a, allowed, enabled):
        """(strobes, reason, piece): what is due on the axis."""
        n = self.axis
        if a.stop_due:
            return ["stopped"], 0, None
        if a.active and not allowed:
            if not a.anchored or not self.rests(n):
                return ["quits"], STOPPED, None
            return [], 0, None if a.full else ("release", [0, 0, 0, 1 | LAST], 1)
        if a.begins(allowed):
            if not enabled:
                return ["quits"], FAULT, None
            return ["began"], 0, ("begin", [0, 0, 0, HOLD], HOLD)
        if a.anchored and a.ending:
            if a.started and self.ends[n][2] + EXTENSION > self.queue.late_limit:
                return ["quits"], ENDED_LATE, None
            return [], 0, ("extend", [self.ends[n][1], 0, 0, EXTENSION], EXTENSION)
        return [], 0, None

    def end(self, n):
        """Where the piece ends: position, velocity, and ticks extrapolated since a set-point."""
        if self.kind == "reach":
            return *self.reached, 0
        if self.kind == "extend":
            position, velocity, late = self.ends[n]
            late = late + EXTENSION if self.axes[n].started else 0
            return position + EXTENSION * velocity, velocity, late
        return self.targets[n] << 24, 0, 0

    def refusal(self, a, complete):
        """Why the set-point of the oldest commit is refused before it is read, or None."""
        distance = signed(self.queue.oldest[1] - self.tick_count - a.ahead)
        self.ticks = distance
        if not a.anchored:
            return NOT_STREAMED
        if not complete:
            return INCOMPLETE
        if distance < SHORTEST:
            return LATE
        if distance > LONGEST:
            return TOO_FAR_AHEAD
        return QUEUE_FULL if a.full else None

    def clk(
        self,
        rst=0,
        tick=0,
        enabled=0,
        stops=0,
        states=None,
        target=None,
        taken=0,
        settled=0,
        **stored,
    ):
        """Advance one cycle. enabled, stops: bits of axes. states: {axis: (moving, braking,
        queued)}; target: (axis, value) or None, results of the engine. stored: as for
        SetPointQueue.
        """
        n, a, queue = self.axis, self.axes[self.axis], self.queue
        self.powered, enabled = enabled, self.powered
        allowed, here_on = queue.allowed >> n & 1, enabled >> n & 1
        strobes, reason, cause, goes_on, begin_piece = [], 0, None, False, False
        ticks = self.ticks
        offered, fetched = self.offer(), self.fetched
        named, complete = queue.oldest[2] >> n & 1, queue.oldest[3] >> n & 1
        phase, start, stop, starts = self.phase, 0, 0, self.starts
        axis, scan, waiting = self.axis, self.scan, len(queue.commits)
        due = [x.due and self.built(i) for i, x in enumerate(self.axes)]
        given = False
        if phase == "rest":
            if any(due):
                axis, scan = self.scan, (self.scan + 1) % self.count
                phase = "look" if due[self.scan] else phase
            elif waiting:
                axis, phase = self.next_axis, "check"
        elif phase == "look":
            strobes, reason, piece = self.look(a, allowed, here_on)
            phase = "offer" if piece else "rest"
            if piece:
                self.kind, self.words, self.ticks = piece
            if "stopped" in strobes:
                stop, phase = 1 << n, "settle"
            starts = int("began" in strobes)
            strobes = ["looked", *strobes]
        elif phase == "check":
            cause = self.refusal(a, complete) if named else None
            goes_on, starts, self.kind, fetched = not named or cause is not None, 0, "reach", 0
            phase = "rest" if goes_on else "fetch"
        elif phase == "fetch":
            fetched += 1
            if self.fetched:
                self.read.append(queue.stored)
            else:
                self.read = []
            if fetched == len(READS) + 1:
                position, _, low, high, _, _ = self.read
                if not low <= position <= high:
                    cause, goes_on, phase = OUT_OF_TRAVEL, True, "rest"
                else:
                    begin_piece, phase = True, "compute"
        elif phase == "compute":
            if self.computed:
                (_, _, beyond), piece = self.computed
                if beyond:
                    cause, goes_on, phase = LIMITS, True, "rest"
                else:
                    acceleration, jerk, *self.reached = piece
                    velocity = self.reached[1] if self.ticks == 1 else self.ends[n][1]
                    self.words = [velocity, acceleration, jerk, self.ticks]
                    phase = "offer"
        elif phase == "offer":
            if not offered:
                phase = "rest"
                if self.kind == "reach":
                    cause, goes_on = NOT_STREAMED, True
            elif taken:
                given = len(self.words) == 1
                self.words.pop(0)
        elif phase == "settle" and settled:
            if starts:
                start, starts = a.active << n, 0
            else:
                phase = "rest"
        if given:
            phase = "settle"
            strobes = ["pushed"]
            if self.kind == "reach":
                strobes.append("accepted")
                goes_on = True
            if self.kind == "extend" and a.started:
                strobes.append("extended")
            if self.kind == "release":
                strobes.append("released")
            self.ends[n] = self.end(n)
        # the maker of pieces
        ends = self.ends.get(n, (0, 0, 0))
        inputs = {}
        if begin_piece:
            position, velocity, _, _, fast, steep = self.read
            inputs = dict(
                begin=ends[:2],
                set_point=(position, velocity << 16),
                ticks=self.ticks,
                limits=((fast % (1 << 31)) << 16, steep << 8),
            )
        found = self.maker.clk(rst=rst, begin_piece=int(begin_piece), **inputs)
        self.computed = found if found[0][1] else None
        # the axes
        done = goes_on and self.next_axis == self.count - 1
        dropped = queue.dropped
        for i, x in enumerate(self.axes):
            if not self.built(i):
                continue
            mine = i == n
            x.clk(
                rst=rst,
                tick=tick,
                allowed=queue.allowed >> i & 1,
                enabled=enabled >> i & 1,
                stops=stops >> i & 1,
                state=(states or {}).get(i),
                ticks=ticks & 255,
                reason=reason,
                cause=cause if mine else None,
                dropped=dropped >> i & 1,
                strobes=strobes if mine else (),
            )
        word = READS[fetched_word] if (fetched_word := self.fetched) < len(READS) else 1
        queue.clk(rst=rst, taken=int(done), read_axis=n, read_word=word, **stored)
        if target:
            self.targets[target[0]] = target[1]
        if goes_on:
            self.next_axis = 0 if done else self.next_axis + 1
        self.phase, self.axis, self.scan, self.fetched = phase, axis, scan, fetched
        self.start, self.stop, self.starts = start, stop, starts
        self.tick_count = (self.tick_count + tick) % WRAP
        if rst:
            self.reset()

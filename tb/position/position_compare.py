# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/position_compare.sv: step() advances one cycle and returns armed, pulse,
late, passed.
"""


def wrapped(value):
    return (value + (1 << 47)) % (1 << 48) - (1 << 47)


class PositionCompare:
    def __init__(self):
        # origin: the shifts since arm; here: the position of the preceding cycle, if it was new
        self.origin, self.here = 0, None
        self.armed = self.seen = self.ready = self.stepped = self.waited = False
        self.reach = self.point = self.stride = self.passed = self.points = self.count = 0
        self.pulse = self.resting = self.timer = (
            0  # timer: cycles left of pulse or gap, including this one
        )

    def past(self, position, point):
        """The distance of position beyond point, in the direction of the points."""
        return wrapped(point - position if self.stride < 0 else position - point)

    def step(
        self,
        start=0,
        step=0,
        count=0,
        pulse_length=1,
        gap_length=1,
        arm=0,
        disarm=0,
        valid=0,
        position=0,
        shift=0,
        shift_periods=0,
        rst=0,
    ):
        if rst:
            self.__init__()
            return 0, 0, 0, 0
        reached = self.past(self.reach, self.point) >= 0
        due = self.armed and self.ready and reached
        busy = self.pulse or self.resting and self.timer > 1
        begins = due and not busy and not arm and not disarm
        late = int(begins and self.waited)
        self.waited = bool(due and busy)
        done = self.stepped and (not self.stride or self.points == self.count)
        farther = self.here is not None and self.past(self.here, self.reach) >= 0
        if self.here is not None and (farther or not (self.ready and reached)):
            self.reach = self.here
        self.ready = self.ready or self.seen and not reached
        self.seen = self.seen or self.here is not None
        self.timer -= 1
        if self.pulse and not self.timer:
            self.pulse, self.resting, self.timer = 0, 1, max(gap_length, 1)
        elif begins:
            self.pulse, self.resting, self.timer = 1, 0, max(pulse_length, 1)
        elif not self.timer:
            self.resting = 0
        self.stepped = begins
        if begins:
            self.point = wrapped(self.point + self.stride)
            self.points += 1
            self.passed = self.points % (1 << 32)
        self.armed = self.armed and not done
        self.here = wrapped(position - (self.origin << 16)) if valid and not arm else None
        self.origin += shift_periods if shift else 0
        if arm:
            self.armed, self.ready, self.seen, self.waited = True, False, False, False
            self.origin = self.passed = self.points = 0
            self.point, self.stride, self.count = start, step, count
        self.armed = self.armed and not disarm
        return int(self.armed), self.pulse, late, self.passed

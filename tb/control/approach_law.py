# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/approach_law.sv decides, in integers, and the whole way to zero that follows from it."""


def decide(change, limit, value, slope, upward, area):
    """(turn, upward_now, last, grow, fall)."""
    turn = slope == 0
    upward_now = int(value < 0) if turn else upward
    left = -value if upward_now else value
    last = turn and left < change
    fall = not turn and (left < area or slope > limit)
    grow = not last and not fall and left >= area + slope + change and slope + change <= limit
    return int(turn), upward_now, int(last), int(grow), int(fall)


class Approach:
    """A value on its way to zero."""

    def __init__(self):
        self.slope = self.area = self.upward = 0

    def step(self, value, change, limit, first=False, above=0):
        """(the value after one step, whether that is the end). first: the slope was `above` this whole number of changes."""
        turn, self.upward, last, grow, fall = decide(change, limit, value, self.slope, self.upward, self.area)
        if first:
            last, grow, fall = 0, grow and not (turn and above), 0
        if last:
            return 0, True
        if grow:
            self.slope += change
            self.area += self.slope
        if fall:
            self.area -= self.slope
            self.slope -= change
        return value + (self.slope if self.upward else -self.slope), False

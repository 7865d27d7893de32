# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/profile_player.sv does, in integers: clk(...) is one clk and returns what is on the pins after it."""
from collections import deque

HALF = 1 << 23


def wrap(x, bits):
    """x as a two's complement number of so many bits."""
    return (x + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def held(x, bits=32):
    """x, stopped at the ends of two's complement of so many bits."""
    return max(-(1 << bits - 1), min((1 << bits - 1) - 1, x))


def moved(velocity, acceleration, jerk, ticks):
    """How far a segment goes, in 2^-40 period: the closed form of the recursion."""
    n = ticks
    return velocity * n + acceleration * (n * (n - 1) // 2) + jerk * (n * (n - 1) * (n - 2) // 6)


class ProfilePlayer:
    def __init__(self, depth=16):
        self.depth, self.exact = depth, 0
        self.velocity = self.acceleration = self.jerk = 0
        self.clear()

    def clear(self):
        self.queue, self.phase = deque(), "wait"
        self.left = self.last = self.moving = self.braking = self.stops = 0
        self.target_velocity = self.target_acceleration = 0

    def pins(self, underrun=0):
        return (wrap(self.exact >> 24, 48), self.target_velocity, self.target_acceleration, self.moving,
                self.depth - len(self.queue), underrun)

    def clk(self, rst=0, tick=0, push=None, start=0, brake=0, hold_here=0, position=0, shift=None, brake_rate=0):
        """push: (velocity, acceleration, jerk, ticks, last) or None. shift: periods or None."""
        if rst:
            self.exact = 0
            self.clear()
            return self.pins()
        if hold_here:
            self.exact = position << 24
            self.clear()
        self.rate = brake_rate << 8
        underrun, waiting, braking = 0, bool(self.queue), self.braking
        room = len(self.queue) < self.depth
        if shift is not None:
            self.exact += shift << 40
        if not hold_here:
            if brake and self.moving:
                self.braking = 1
            if self.phase == "load":
                underrun = self.load(braking)
            elif self.phase == "step":
                if shift is None:
                    self.step(braking)
            elif self.phase == "round":
                if shift is None:
                    self.exact = self.exact + HALF >> 24 << 24
                    self.target_velocity = self.target_acceleration = 0
                    self.left = self.last = self.moving = self.braking = 0
                    self.phase = "wait"
            else:
                if tick and self.moving:
                    self.phase = "load"
                if start and waiting:
                    self.moving = 1
            if push and room and not braking:
                self.queue.append(push)
            if brake:
                self.queue.clear()
        self.exact = wrap(self.exact, 72)
        return self.pins(underrun)

    def load(self, braking):
        """Make ready for the step; return whether the queue ran dry."""
        rate, underrun, self.phase = self.rate, 0, "step"
        self.stops = rate == 0 or abs(self.velocity) <= rate
        if not braking and self.left == 0:
            if self.last:
                self.phase = "round"
            elif self.queue:
                self.velocity, self.acceleration, self.jerk, self.left, self.last = self.queue.popleft()
                if self.left == 0:
                    self.phase = "load"
            else:
                underrun = braking = self.braking = 1
        if braking:
            self.acceleration = -self.velocity if self.stops else rate if self.velocity < 0 else -rate
        return underrun

    def step(self, braking):
        self.exact += self.velocity
        self.target_velocity, self.target_acceleration = held(self.velocity >> 24), held(self.acceleration >> 24)
        self.velocity = wrap(self.velocity + self.acceleration, 64)
        self.acceleration = wrap(self.acceleration + self.jerk, 64)
        self.phase = "round" if (self.stops if braking else self.last and self.left == 1) else "wait"
        self.left = (self.left - 1) % (1 << 24)

# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/profile_player.sv does, in integers: clk(...) is one clk and returns what is on the pins after it."""
from collections import deque

from approach_law import Approach

HALF = 1 << 23
FULL = 1 << 32


def wrap(x, bits=64):
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
        self.stand()
        self.empty()

    def empty(self):
        self.queue, self.armed = deque(), 0

    def stand(self):
        """As at the end of a profile."""
        self.life = self.ticks()
        self.velocity = self.acceleration = self.jerk = self.left = self.last = self.fraction = self.offset = 0
        self.step = self.change = self.ready = self.final = self.ended = 0
        self.moving = self.braking = self.target_velocity = self.target_acceleration = 0
        self.brake = None

    def pins(self):
        return (wrap(self.exact >> 24, 48), self.target_velocity, self.target_acceleration, self.moving, self.armed,
                self.depth - len(self.queue), self.underrun)

    def clk(self, rst=0, tick=0, push=None, start=0, brake=0, hold_here=0, position=0, shift=None, brake_rate=0, brake_jerk=0, rate=FULL,
            arm=0, start_at=0, now=0):
        """push: (velocity, acceleration, jerk, ticks, last) or None. shift: periods or None."""
        self.underrun = 0
        if rst or hold_here:
            self.exact = 0 if rst else position << 24
            if shift is not None and not rst:
                self.exact = wrap(self.exact + (shift << 40), 72)
            self.stand()
            self.empty()
            return self.pins()
        self.tick, self.shifted, self.rate, self.brake_rate, self.brake_jerk = tick, shift is not None, rate, brake_rate, brake_jerk
        moving, waiting, room = self.moving, bool(self.queue), len(self.queue) < self.depth and not self.braking
        reached = self.armed and wrap(now - start_at, 32) >= 0
        if self.shifted:
            self.exact += shift << 40
        finished = next(self.life)
        if finished:
            self.stand()
        else:
            self.braking |= int(bool(brake and moving) or self.underrun)
        if (start or reached) and waiting and not moving and not brake:
            self.moving = 1
        self.armed = int((arm or (self.armed and not reached)) and not brake)
        if push and room:
            self.queue.append(push)
        if brake or self.underrun:
            self.queue.clear()
        self.exact = wrap(self.exact, 72)
        return self.pins()

    def ticks(self):
        """What goes on, a yield for each clk; True in the clk that ends a profile."""
        while True:
            while not (self.tick and self.moving):
                yield
            braking = self.braking
            yield
            if self.ready:
                while self.shifted:
                    yield
                self.exact += self.step
                self.target_velocity, self.target_acceleration = held(self.step >> 24), held(self.change >> 24)
                braking = self.braking
                yield
                if self.final:
                    while self.shifted:
                        yield
                    self.exact = self.exact + HALF >> 24 << 24
                    yield True
            if braking or (yield from self.interval()):
                yield from self.stop()

    def interval(self):
        """Prepare the next step of the profile; True: it is to be a brake instead."""
        crossed, self.fraction = divmod(self.fraction + self.rate, FULL)
        base = -self.offset
        yield
        while self.left == 0 and not self.ended or crossed:
            if self.left == 0:
                if not self.braking and self.last:
                    self.velocity = self.acceleration = crossed = 0
                    self.ended = 1
                elif self.braking or not self.queue:
                    self.underrun = int(not self.braking)
                    yield
                    return True
                else:
                    self.velocity, self.acceleration, self.jerk, self.left, self.last = self.queue.popleft()
            else:
                base += self.velocity
                self.velocity, self.acceleration = wrap(self.velocity + self.acceleration), wrap(self.acceleration + self.jerk)
                self.left -= 1
                crossed = 0
            yield
        yield
        self.offset = self.velocity >> 1
        if self.fraction and not self.ended:
            for _ in range(64):
                yield
            slope = wrap(self.velocity + (self.acceleration * self.fraction >> 33))
            self.offset = wrap(self.offset + (slope * self.fraction >> 32))
        step = wrap(base + self.offset)
        self.step, self.change, self.ready, self.final = step, wrap(step - self.step), 1, self.ended
        yield
        return False

    def stop(self):
        """Prepare the next step of a brake."""
        first = self.brake is None
        if first:
            self.brake = self.begin_to_brake()
            for _ in range(129):
                yield
        law = self.brake
        step, self.final = law.step(self.step, law.pace, self.brake_rate << 8, first, law.above)
        if law.abrupt:
            step, self.final = 0, True
        yield
        step = wrap(step)
        self.step, self.change, self.ready = step, wrap(step - self.step), 1
        yield

    def begin_to_brake(self):
        """The law, with a slope of as many whole paces as the acceleration is high."""
        law, limit, rest = Approach(), self.brake_rate << 8, 0
        law.pace = self.brake_jerk if 0 < self.brake_jerk <= limit else limit
        law.abrupt, law.upward = limit == 0, int(self.change >= 0)
        for n in reversed(range(64)):
            rest = 2 * rest + (abs(self.change) >> n & 1)
            more = law.pace if rest >= law.pace else 0
            law.abrupt |= law.area >> 60 > 0                # more than any velocity
            law.area = (4 * law.area + (law.slope if rest >= law.pace else -law.slope) + more) % (1 << 64)
            law.slope = 2 * law.slope + more
            rest -= more
        law.above = rest % (1 << 40)
        return law

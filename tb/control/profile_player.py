# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/profile_player.sv in integers: clk(...) advances one cycle and returns the
outputs after it.
"""

from collections import deque

HALF = 1 << 23
FULL = 1 << 32


def wrap(x, bits=64):
    """x as a two's complement number of `bits` bits."""
    return (x + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def held(x, bits=32):
    """x, limited to the range of a two's complement number of `bits` bits."""
    return max(-(1 << bits - 1), min((1 << bits - 1) - 1, x))


def moved(velocity, acceleration, jerk, ticks):
    """The distance of a segment in 2^-40 period: the closed form of the recursion."""
    n = ticks
    return velocity * n + acceleration * (n * (n - 1) // 2) + jerk * (n * (n - 1) * (n - 2) // 6)


def clks(count):
    for _ in range(count):
        yield


class Ramp:
    """A ramp of a value to zero: its slope, a whole number of increments, and the area that the
    slope still adds while it falls to zero.
    """

    def __init__(self):
        self.slope = self.area = self.increment = self.upward = 0

    def decide(self, value, limit):
        """Return (what the slope must do, cycles of this decision)."""
        turn = self.slope == 0
        if turn:
            self.upward = int(value < 0)
        left = -value if self.upward else value
        if turn and left < self.increment:
            return "last", 6
        if not turn and (left < self.area or self.slope > limit):
            return "fall", 5 if left < self.area else 7
        clk = 6 if turn else 7
        if left < self.area + self.slope + self.increment:
            return "stay", clk + 4
        return ("stay", clk + 7) if self.slope + self.increment > limit else ("grow", clk + 7)

    def change(self, what):
        """Change the slope so; return the cycles that this takes."""
        if what == "grow":
            self.slope += self.increment
            self.area += self.slope
            return 2
        if what == "fall":
            self.area -= self.slope
            self.slope -= self.increment
            return 4
        return 0

    def signed(self):
        return self.slope if self.upward else -self.slope

    def choose(self, limit, curve):
        """Choose the increment of a new ramp; return the cycles that this takes."""
        self.increment = limit if curve == 0 or curve > limit else curve
        return 3 if curve > limit else 4 if curve == 0 else 5


class ProfilePlayer:
    def __init__(self, depth=16):
        self.depth, self.exact = depth, 0
        self.stand()
        self.empty()

    def empty(self):
        self.queue, self.armed, self.writing = deque(), 0, 0

    def stand(self):
        """The state at the end of a profile."""
        self.life = self.ticks()
        self.velocity = self.acceleration = self.jerk = self.left = self.last = self.fraction = (
            self.offset
        ) = 0
        self.step = self.change = self.ready = self.final = self.arrived = self.rate = 0
        self.moving = self.braking = self.target_velocity = self.target_acceleration = 0
        self.ramp, self.stop_ramp = Ramp(), None

    def pins(self):
        return (
            wrap(self.exact >> 24, 48),
            self.target_velocity,
            self.target_acceleration,
            self.moving,
            self.armed,
            self.depth - len(self.queue),
            self.underrun,
        )

    def clk(
        self,
        rst=0,
        tick=0,
        push=None,
        start=0,
        controlled_stop=0,
        set_target_to_position=0,
        position=0,
        shift=None,
        stop_deceleration=0,
        stop_jerk=0,
        slope=0,
        curve=0,
        feed_fraction=65536,
        pause=0,
        arm=0,
        start_at=0,
        now=0,
    ):
        """Advance one cycle. push: (velocity, acceleration, jerk, ticks, last) or None; shift:
        2^-16 period or None.
        """
        self.underrun = 0
        if rst or set_target_to_position:
            self.exact = 0 if rst else position << 24
            if shift is not None and not rst:
                self.exact = wrap(self.exact + (shift << 24), 72)
            self.stand()
            self.empty()
            return self.pins()
        self.tick, self.shifted, self.stop_now, self.stop_deceleration, self.stop_jerk = (
            tick,
            shift is not None,
            controlled_stop,
            stop_deceleration,
            stop_jerk,
        )
        self.slope, self.curve, self.setting = (
            slope,
            curve,
            0 if pause else min(feed_fraction, 65536) << 16,
        )
        moving, waiting = self.moving, bool(self.queue)
        room = len(self.queue) < self.depth and not self.braking and not self.writing
        reached = self.armed and wrap(now - start_at, 32) >= 0
        if self.shifted:
            self.exact += shift << 24
        if next(self.life):
            self.stand()
        else:
            self.braking |= int(bool(controlled_stop and moving) or self.underrun)
        if (start or reached) and waiting and not moving and not controlled_stop:
            self.moving = 1
        self.armed = int((arm or (self.armed and not reached)) and not controlled_stop)
        self.writing = max(0, self.writing - 1)
        if push and room:
            self.queue.append(push)
            self.writing = 6
        if controlled_stop or self.underrun:
            self.queue.clear()
            self.writing = 0
        self.exact = wrap(self.exact, 72)
        return self.pins()

    def ticks(self):
        """The work of all ticks, one yield per cycle; it yields True in the cycle that ends a
        profile.
        """
        while True:
            while not (self.tick and self.moving):
                yield
            braking = self.braking
            yield
            if self.ready:
                while self.shifted:
                    yield
                self.exact += self.step
                if self.final:
                    self.exact = self.exact + HALF >> 24 << 24
                    yield True
                self.target_velocity = held(self.step >> 24)
                yield
                self.target_acceleration = held(self.change >> 24)
                braking = self.braking
                yield
            else:
                yield from clks(5)
            if braking or (yield from self.interval()):
                yield from self.stop()
            yield from clks(2)
            self.ready = 1
            yield

    def rate_step(self):
        """Bring the rate one step nearer to its setting."""
        ramp = self.ramp
        if not self.ready or self.slope == 0:
            yield from clks(5 if self.ready else 3)
            self.rate, self.arrived = self.setting, 0
            ramp.slope = ramp.area = 0
            return
        yield from clks(
            3 + (2 + ramp.choose(self.slope, self.curve) - 1 if ramp.slope == 0 else 0) + 1
        )
        distance = self.rate - self.setting
        new = ramp.slope == 0
        what, clk = ramp.decide(distance, self.slope)
        if new and self.arrived:  # one tick without change before the next ramp
            yield from clks(4 + 2)
            self.arrived = 0
        elif what == "last":
            yield from clks(clk + 1 + 3)
            self.rate, self.arrived = self.setting, int(distance != 0)
            return
        else:
            yield from clks(clk + ramp.change(what) + 2)
        rate = self.rate + ramp.signed()
        yield from clks(2 if rate < 0 else 2 if rate < FULL else 3)
        self.rate = max(0, min(FULL, rate))

    def interval(self):
        """Prepare the next step of the profile; True: a controlled stop must begin instead."""
        yield from self.rate_step()
        base = -self.offset
        yield
        if not self.ready and (yield from self.load()):
            return True
        if not self.final:
            self.fraction += self.rate
            yield from clks(4)
            if self.fraction >= FULL:
                self.fraction -= FULL
                base += self.velocity
                self.velocity, self.acceleration = (
                    self.velocity + self.acceleration,
                    self.acceleration + self.jerk,
                )
                self.left -= 1
                yield from clks(11)
                if self.left == 0 and (yield from self.load()):
                    return True
        if self.final:
            self.offset = 0
            yield
        else:
            slope = self.velocity + (self.acceleration * self.fraction >> 33)
            self.offset = (self.velocity >> 1) + (slope * self.fraction >> 32)
            yield from clks(2 + (71 if self.fraction else 0) + 1)
        self.change = base + self.offset - self.step
        self.step += self.change
        yield from clks(2)
        return False

    def load(self):
        """Take the next segment, or the end; True: there is none, or a controlled stop."""
        while True:
            last = self.last and not self.braking
            yield
            if last:
                self.final = 1
                return False
            if self.braking or not self.queue:
                self.underrun = int(not self.braking)
                yield
                return True
            self.velocity, self.acceleration, self.jerk, self.left, self.last = self.queue[0]
            yield from clks(8)
            if self.queue and not self.stop_now:
                self.queue.popleft()
            yield from clks(3)
            if self.left:
                yield
                return False

    def stop(self):
        """Prepare the next step of a controlled stop."""
        limit, first, abrupt = self.stop_deceleration << 8, self.stop_ramp is None, False
        yield
        if first:
            self.stop_ramp = Ramp()
            yield
            abrupt = limit == 0
            if not abrupt:
                abrupt, what = yield from self.begin_to_stop(limit)
        if abrupt:
            what = "last"
        elif not first or what is None:
            what, clk = self.stop_ramp.decide(self.step, limit)
            yield from clks(clk)
            if first and what in ("last", "fall"):
                what = "stay"
                yield
            elif what == "last":
                yield from clks(2)
            yield from clks(self.stop_ramp.change(what))
        if what == "last":
            self.change, self.final = -self.step, 1
        else:
            self.change = self.stop_ramp.signed()
        self.step += self.change
        yield

    def begin_to_stop(self, limit):
        """Start with a slope of as many whole increments as the acceleration has. Return (whether
        the motion is too fast to stop within limits, "stay" if the slope must not grow at this
        step).
        """
        ramp = self.stop_ramp
        yield from clks(1 + ramp.choose(limit, self.stop_jerk) + 1 + 3 + 31)
        ramp.upward = int(self.change > 0)
        quotient, remainder = divmod(abs(self.change), ramp.increment)
        quotient = min(quotient, (1 << 32) - 1)
        yield from clks(32 * 5 + quotient.bit_count() + 3)
        ramp.slope, ramp.area = (
            quotient * ramp.increment,
            quotient * ramp.increment * (quotient + 1) // 2,
        )
        if abs(self.change) - ramp.slope >= ramp.increment:
            return True, None
        yield from clks(2 + 64 + 1)
        if ramp.slope * (quotient & ~1) >= 1 << 68:
            return True, None
        yield from clks(3)
        # with a remainder but no slope, the other side would be more than an increment
        if ramp.slope or not remainder:
            if not ramp.slope:
                yield
            return False, None
        yield
        return False, "stay"

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/motion_engine.sv for one axis in integers: serve(...) executes requests
between two ticks, tick(...) a servo tick; both return what the engine reports, in its order.
"""

from tables.microcode.numbers import FLAGS

FULL = 1 << 32  # of a rate
DEPTH = 16  # segments in the queue
SLOT_HALF = 1 << 23  # half an LSB of target in 2^-40 period
LONGEST = (1 << 24) - 1  # cycles: the longest time without a step
K = 20  # fraction bits of period / time
FILTER_FRACTION = 32  # bits of a coefficient
REQUESTS = ("shift", "set", "push", "start", "arm", "stop")
SETTINGS = dict.fromkeys(
    (
        "override",
        "override_slope",
        "override_curve",
        "stop_deceleration",
        "stop_jerk",
        "kp",
        "ki",
        "kd",
        "kv",
        "ka",
        "output_limit",
        "integral_limit",
        "dead_band",
        "open_command",
        "following_limit",
        "step_ratio",
        "trim_scale",
        "quantum",
        "start_at",
        "segment_velocity",
        "segment_acceleration",
        "segment_jerk",
        "segment_ticks",
    ),
    0,
)
LAST = 1 << 24  # in segment_ticks: the profile ends with this segment


def between(value, low, high):
    return max(low, min(high, value))


def clamped(value, bits=32):
    """value, limited to the range of a signed number of so many bits."""
    return between(value, -(1 << bits - 1), (1 << bits - 1) - 1)


def wrap(value, bits):
    """value as a two's complement number of so many bits."""
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def moved(velocity, acceleration, jerk, ticks):
    """The distance of a segment in 2^-40 period: the closed form of the recursion."""
    n = ticks
    return velocity * n + acceleration * (n * (n - 1) // 2) + jerk * (n * (n - 1) * (n - 2) // 6)


class Ramp:
    """A ramp of a value to zero: its slope, a whole number of increments, and the area that the
    slope still adds while it falls to zero.
    """

    def __init__(self):
        self.slope = self.area = self.increment = self.upward = 0

    def choose(self, limit, curve):
        """Choose the increment of a new ramp."""
        self.increment = limit if curve == 0 or curve > limit else curve

    def decide(self, value, limit):
        """What the slope must do."""
        turn = self.slope == 0
        if turn:
            self.upward = int(value < 0)
        left = -value if self.upward else value
        if turn and left < self.increment:
            return "last"
        if not turn and (left < self.area or self.slope > limit):
            return "fall"
        if left < self.area + self.slope + self.increment:
            return "stay"
        return "stay" if self.slope + self.increment > limit else "grow"

    def change(self, what):
        """Change the slope so."""
        if what == "grow":
            self.slope += self.increment
            self.area += self.slope
        elif what == "fall":
            self.area -= self.slope
            self.slope -= self.increment

    def signed(self):
        return self.slope if self.upward else -self.slope


class Filter:
    """A second-order filter with error feedback; coefficients in 2^-32."""

    def __init__(self):
        self.coefficients, self.in_use = [0] * 5, 0
        self.reset()

    def reset(self):
        self.x, self.y, self.cut_off, self.known, self.filtering = (0, 0), (0, 0), 0, 0, 0

    def sample(self, x, passing):
        works = not passing and self.filtering and self.in_use
        y = x
        if works:
            total = (
                sum(c * s for c, s in zip(self.coefficients, (x, *self.x, *self.y))) + self.cut_off
            )
            y, self.cut_off = total >> FILTER_FRACTION, total % (1 << FILTER_FRACTION)
            if clamped(y) != y:
                y, self.cut_off = clamped(y), 0
        elif not passing:
            self.cut_off = 0
        self.filtering = 0 if passing else self.known and self.in_use
        self.known = 1
        self.x, self.y = (x, self.x[0]), (y, self.y[0])
        return y


class Axis:
    def __init__(self, filters=0):
        self.settings = dict(SETTINGS)
        self.shift_by = 0  # of the last shift
        self.take_up = 0  # of the backlash
        self.filters = [Filter() for _ in range(filters)]
        self.reset()

    def reset(self):
        """The state after reset. Settings stay."""
        self.anchor = self.moved = self.target = 0
        self.target_velocity = self.target_acceleration = 0
        self.head, self.queue = 0, []
        self.armed = self.powered = self.limited_up = self.limited_down = self.anchored = 0
        self.rebased = self.last_position = self.run = self.quiet = self.speed = 0
        self.integral = self.sum = self.command = 0
        self.velocity = self.acceleration = self.jerk = self.left = self.fraction = 0
        self.offset = self.rate = self.step = self.change = 0
        self.ramp, self.stop_ramp = Ramp(), Ramp()
        self.stand()
        for filter in self.filters:
            filter.reset()

    def stand(self):
        self.moving = self.braking = self.stopping = self.last = self.final = self.ready = 0
        self.arrived = 0
        self.step = self.change = self.target_velocity = self.target_acceleration = 0
        self.moved = 0

    def state(self):
        flags = sum(getattr(self, name, 0) << n for n, name in enumerate(FLAGS, start=1))
        return "state", flags | self.head << 16 | len(self.queue) << 20

    # requests

    def serve(self, requests, position):
        """Execute the requests in the engine's order, between two ticks."""
        found = self.shift() if "shift" in requests else []
        if "set" in requests:
            self.anchor = self.target = position
            self.stand()
            self.armed, self.rebased, self.queue = 0, 1, []
            found += [("target", position), ("target_velocity", 0)]
        s = self.settings
        room = len(self.queue) < DEPTH and not self.braking
        if "push" in requests and room and s["segment_ticks"]:
            self.queue.append(
                tuple(s[f"segment_{n}"] for n in ("velocity", "acceleration", "jerk", "ticks"))
            )
        if "start" in requests and "stop" not in requests:
            self.start()
        if "arm" in requests:
            self.armed = 1
        if "stop" in requests:
            self.armed, self.queue = 0, []
            self.braking |= self.moving
        return [*found, self.state()]

    def start(self):
        if self.queue:
            self.moving = 1

    def shift(self):
        by = self.shift_by
        self.anchor, self.target = self.anchor + by, self.target + by
        self.last_position, self.run = self.last_position + by, self.run + by
        self.rebased = 1
        return [("target", self.target)]

    # a tick

    def tick(
        self,
        position,
        period,
        now=0,
        stepped=None,
        block_up=0,
        block_down=0,
        closed_loop=1,
        lost=0,
        lost_off=0,
        gains_changed=0,
        requests=(),
    ):
        """A servo tick. stepped: None, or (cycles from the tick before to the last step, whether it
        went down); lost, lost_off: the loop was open or the drive was off, or the drive was off, at
        or since the tick before; requests: shift and start.
        """
        found = self.shift() if "shift" in requests else []
        if "start" in requests:
            self.start()
        measured = self.measure(position, period, stepped)
        found.append(("velocity", measured))
        s = self.settings
        if self.armed and wrap(now - s["start_at"], 32) >= 0:
            self.armed = 0
            self.start()
        found += self.make()
        found += self.servo(
            position, measured, block_up, block_down, closed_loop, lost, lost_off, gains_changed
        )
        found += self.steps(block_up, block_down, lost_off)
        found += self.prepare()
        return [*found, self.state()]

    def measure(self, position, period, stepped):
        quantum = self.settings["quantum"]
        distance = position - self.last_position
        self.last_position = position
        if stepped:
            elapsed, down = stepped
            edge = position + (quantum if down else 0)
            span = self.quiet + elapsed
            self.quiet = period - elapsed
            if self.anchored and span < LONGEST:
                self.speed = self.quotient(edge - self.run, period, span)
            else:
                self.anchored, self.speed = 1, 0
            self.run = edge
        else:
            self.quiet = min(self.quiet + period, LONGEST)
            if self.anchored and 2 * self.quiet > period:
                if self.quiet == LONGEST:
                    self.speed = 0
                elif self.speed < 0:
                    self.speed = max(self.speed, self.quotient(-quantum, period, self.quiet))
                else:
                    self.speed = min(self.speed, self.quotient(quantum, period, self.quiet))
        near = wrap(distance, 35) << 8
        fine = near + between(self.speed - near, -(quantum << 8), quantum << 8)
        return clamped(fine + 128 >> 8)

    @staticmethod
    def quotient(distance, period, span):
        """2^-24 period/tick: distance * period / span, at most twice the distance."""
        ratio = (period << K) // max(2 * span, period)
        return wrap(distance, 35) * ratio >> K - 9

    def make(self):
        """The target makes the step that was prepared."""
        if not (self.moving and self.ready):
            return []
        self.moved = wrap(self.moved + self.step, 72)
        if self.final:
            self.target = self.anchor = self.anchor + (wrap(self.moved + SLOT_HALF, 72) >> 24)
            self.stand()
        else:
            self.target = self.anchor + (self.moved >> 24)
            self.target_velocity = clamped(self.step >> 24)
            self.target_acceleration = clamped(self.change >> 24)
        return [("target", self.target), ("target_velocity", self.target_velocity)]

    def servo(
        self, position, velocity, block_up, block_down, closed, lost, lost_off, gains_changed
    ):
        s = self.settings
        off = block_up and block_down
        error = clamped(self.target - position)
        too_far = int(0 < s["following_limit"] < abs(error))
        if lost:
            self.integral = self.powered = 0
            self.sum = 0 if lost_off else self.command << 16
        blocked = block_down or self.limited_down if error < 0 else block_up or self.limited_up
        constant = blocked or not self.moving and abs(error) <= s["dead_band"]
        limit = s["integral_limit"]
        self.integral = between(self.integral + (0 if constant else s["ki"] * error), -limit, limit)
        total = integral = self.integral >> 8
        total += s["kp"] * error + s["kd"] * (self.target_velocity - velocity)
        total += s["kv"] * self.target_velocity + s["ka"] * self.target_acceleration
        if lost:
            total = self.sum
        else:
            if (gains_changed or not self.powered) and s["ki"]:
                jump = self.sum - clamped(total, 34)
                self.integral = between(self.integral + (jump << 8), -limit, limit)
                total = self.sum
            self.powered = 1
        high = s["output_limit"]
        self.limited_up, self.limited_down = int(total - high >= 65536), int(total < -high)
        self.sum = high if self.limited_up else -high if self.limited_down else total
        sample = self.sum if closed else s["open_command"] << 16
        for filter in self.filters:
            sample = filter.sample(sample, lost)
        if closed:
            command, limit = (self.sum if lost else sample) >> 16, high >> 16
            self.command = between(command, -limit, limit)
            self.limited_up |= int(command > limit)
            self.limited_down |= int(command < -limit)
        else:
            self.command, self.limited_up, self.limited_down = s["open_command"], 0, 0
        if not closed or off:
            self.integral = self.powered = 0
            self.sum = 0 if off else self.command << 16
        saturated = self.limited_up | self.limited_down
        return [
            ("error", error, too_far),
            ("integral", integral),
            ("command", self.command, saturated),
        ]

    def steps(self, block_up, block_down, lost_off):
        s = self.settings
        blocked = block_down if self.command < 0 else block_up
        required = self.target + (0 if blocked else self.command * s["trim_scale"]) + self.take_up
        restart = int(bool(self.rebased or lost_off))
        self.rebased = 0
        return [("steps", wrap(required * s["step_ratio"] >> 32, 48), restart)]

    # the profile: prepare the step of the next tick

    def prepare(self):
        if not self.moving:
            return []
        if self.braking:
            self.stop()
            self.ready = 1
            return []
        found = self.interval()
        self.ready = 1
        return found

    def rate_step(self):
        """Bring the rate one step nearer to its setting."""
        ramp, s = self.ramp, self.settings
        slope = s["override_slope"]
        if not self.ready or slope == 0:
            self.rate, self.arrived = s["override"], 0
            ramp.slope = ramp.area = 0
            return
        if ramp.slope == 0:
            ramp.choose(slope, s["override_curve"])
        distance = self.rate - s["override"]
        new = ramp.slope == 0
        what = ramp.decide(distance, slope)
        if new and self.arrived:  # one tick without change before the next ramp
            self.arrived = 0
        elif what == "last":
            self.rate, self.arrived = s["override"], int(distance != 0)
            return
        else:
            ramp.change(what)
        self.rate = between(self.rate + ramp.signed(), 0, FULL)

    def interval(self):
        if not self.ready:
            self.offset = self.fraction = 0
        self.rate_step()
        base = -self.offset
        if not self.ready and not self.load():
            return self.starve()
        if not self.final:
            self.fraction += self.rate
            if self.fraction >= FULL:
                self.fraction -= FULL
                base += self.velocity
                self.velocity += self.acceleration
                self.acceleration += self.jerk
                self.left -= 1
                if self.left == 0 and not self.load():
                    return self.starve()
        if self.final:
            self.offset = 0
        else:
            slope = self.velocity + (
                wrap(self.acceleration >> 32, 35) * self.fraction
                + ((self.acceleration & FULL - 1) * self.fraction >> 32)
                >> 1
            )
            self.offset = (self.velocity >> 1) + (
                wrap(slope >> 32, 35) * self.fraction + ((slope & FULL - 1) * self.fraction >> 32)
                if self.fraction
                else 0
            )
        self.change = base + self.offset - self.step
        self.step += self.change
        return []

    def load(self):
        """Take the next segment, or the end; False: there is none."""
        while True:
            if self.last:
                self.final = 1
                return True
            if not self.queue:
                return False
            self.velocity, self.acceleration, self.jerk, ticks = self.queue.pop(0)
            self.head = (self.head + 1) % DEPTH
            self.left, self.last = ticks % LAST, ticks // LAST
            if self.left:
                return True

    def starve(self):
        """A segment is missing: the acceleration stays for this tick, then a stop begins."""
        self.braking, self.queue = 1, []
        self.step += self.change
        return [("underrun", None)]

    def stop(self):
        """Prepare the next step of a controlled stop."""
        s, ramp = self.settings, self.stop_ramp
        limit, first, what = s["stop_deceleration"], not self.stopping, None
        self.stopping = 1
        if first:
            what = "last" if limit == 0 else self.begin_to_stop(limit)
        if what is None:
            what = ramp.decide(self.step, limit)
            if first and what in ("last", "fall"):
                what = "stay"
            ramp.change(what)
        if what == "last":
            self.change, self.final = -self.step, 1
        else:
            self.change = ramp.signed()
        self.step += self.change

    def begin_to_stop(self, limit):
        """Start with a slope of as many whole increments as the acceleration has. "last": the
        motion is too fast to stop within limits; "stay": the slope must not grow at this step.
        """
        ramp = self.stop_ramp
        ramp.choose(limit, self.settings["stop_jerk"])
        ramp.upward = int(self.change > 0)
        quotient, remainder = divmod(abs(self.change), ramp.increment)
        if quotient >> 32:
            return "last"
        ramp.slope = quotient * ramp.increment
        ramp.area = ramp.slope * (quotient + 1) // 2
        if ramp.slope >= 1 << 66 or (ramp.slope >> 32) * quotient >= 1 << 36:
            return "last"
        return "stay" if remainder and not ramp.slope else None

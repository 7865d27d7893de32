# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/velocity_estimator.sv: step() advances one cycle and returns velocity,
fine.
"""

K = 20  # fraction bits of tick / time between two steps
BUSY = K + 3  # cycles from the start of a division to its end
P = 33  # bits of a position


def wrapped(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def between(value, low, high):
    return max(low, min(high, value))


def quotient(distance, period, span):
    """2^-24 period/tick: distance * period / span, with the quotient of the times truncated after K
    bits; at most twice the distance.
    """
    divisor = max(2 * span, period)
    ratio = (
        (period << K) // divisor if divisor else (1 << K + 1) - 1
    )  # the result of the divider for a division by 0
    return wrapped((distance * ratio) >> K - 9, P + 10)


class VelocityEstimator:
    def __init__(self, time_w=24):
        self.longest = (1 << time_w) - 1
        self.velocity = self.fine = self.speed = 0
        self.origin = self.now = self.quiet = self.since_tick = self.period = self.age = 0
        self.here = self.here_q = self.last = None
        self.stepped = None  # here_q has just moved: True upwards, False downwards
        self.ticks = [None] * 5  # pipeline of each tick, the youngest first
        self.latest = self.run = self.base = None  # (edge, time) of steps
        self.fresh, self.busy, self.task = False, 0, None

    def step(self, quantum, tick, position, shift, shift_periods):
        before, here, here_q, stepped, quiet = (
            self.ticks,
            self.here,
            self.here_q,
            self.stepped,
            self.quiet,
        )
        run, speed, now, base = self.run, self.speed, self.now, self.base
        # the pipeline from tick to velocity
        self.ticks = [True if tick else None, None, None, None, None]
        ticked = before[0]
        if ticked:
            self.ticks[1] = wrapped(here - self.last, P) if self.last is not None else 0
            self.last = here
        if before[1] is not None:
            distance = between(before[1], -1 << 31, (1 << 31) - 1)
            self.ticks[2] = (
                max(distance - quantum, -1 << 31),
                min(distance + quantum, (1 << 31) - 1),
            )
        if before[2] is not None:
            self.ticks[3], low_high = True, before[2]
        if before[3]:
            self.velocity = (self.fine + 128) >> 8
        if before[2] is not None:
            self.fine = between(speed, low_high[0] << 8, low_high[1] << 8)
        # the divisions in turn
        if self.busy:
            self.busy -= 1
            if not self.busy:
                distance, span, period, bounding = self.task
                found = quotient(distance, period, span)
                if not bounding:
                    self.speed = found
                elif quiet == self.longest:
                    self.speed = 0
                elif 2 * span <= period:  # half a tick or less gives no limit
                    pass
                elif speed < found if speed < 0 else speed > found:
                    self.speed = found
            elif self.busy == BUSY - 1:  # the length of the tick is latched together with the times
                distance, span, _, bounding = self.task
                self.task = distance, span, self.period, bounding
        elif self.latest is not None:
            self.busy = BUSY
            if self.fresh:
                edge, time = self.latest
                self.task = wrapped(edge - base[0], P), time - base[1], 0, False
                self.run = self.latest
            else:
                self.task = -quantum if speed < 0 else quantum, quiet, 0, True
            self.fresh = False
        if ticked:
            self.period = min(self.since_tick + 1, self.longest)
            self.base = run
        self.since_tick = 0 if ticked else min(self.since_tick + 1, self.longest)
        # a step
        self.quiet = 0 if stepped is not None else min(quiet + 1, self.longest)
        if stepped is not None:
            edge = here_q + (0 if stepped else quantum)
            if self.latest is None or quiet == self.longest:
                self.run = self.base = edge, now
                self.fresh, self.busy, self.speed = False, 0, 0
            else:
                self.fresh = True
            self.latest = edge, now
        self.stepped = None
        if here_q is not None and wrapped(here - here_q, P):
            self.stepped = wrapped(here - here_q, P) > 0
        self.here_q, self.here = here, wrapped(position - (self.origin << 16), 48)
        self.origin += shift_periods if shift else 0
        self.now += 1
        return self.velocity, self.fine

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_lines.sv in integers: clk(...) advances one cycle and returns the outputs
in this cycle; rate_of(...) is the arithmetic of one line.
"""

TOO_FAR = object()


def wrapped(value, bits=48):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def rate_of(distance, rest, period, rate_f=36):
    """(rate, rest for the next line) of a line over `distance` 2^-16 step, or TOO_FAR."""
    if not -period << 16 <= distance < period << 16:
        return TOO_FAR
    return divmod((distance << rate_f - 16) + rest, period)


class Axis:
    def __init__(self):
        self.target = self.end = self.rest = 0
        self.fresh = self.restart = self.given = False


class StepLines:
    def __init__(self, axes=1, rate_f=36):
        self.rate_f, self.axes = rate_f, [Axis() for _ in range(axes)]
        self.reset()

    def reset(self):
        self.left, self.waiting, self.n, self.state = 0, False, 0, "seek"
        self.bits = 0  # left of the quotient
        for axis in self.axes:
            axis.fresh = axis.restart = axis.given = False

    def clk(self, rst=0, period=0, tick=0, valid=0, axis=0, target=0, restart_in=0, stopped=0):
        """(line_start, line_idle, rate_valid, what is given with it); the last is None or (rate,
        restart, steep).
        """
        ended = self.left == 0 or stopped == (1 << len(self.axes)) - 1
        served = self.axes[self.n]
        start = bool((tick or self.waiting) and ended and period)
        gives = self.state == "give"
        out = (
            int(start),
            int(ended and not start),
            int(gives) << self.n,
            self.given if gives else None,
        )
        take = self.state == "seek" and served.fresh and not served.given
        self.waiting = bool((tick or self.waiting) and not start)
        self.left = period - 1 if start else max(self.left - 1, 0)
        for one in self.axes:
            one.given = one.given and not start
        if gives:
            served.given = True
            if self.restarts:
                served.rest = period - 1
            elif self.rest is not None:
                served.rest = self.rest

        if self.state == "seek" and not take:
            self.n = (self.n + 1) % len(self.axes)
        elif take:
            self.begin(served, served.restart or stopped >> self.n & 1 or not period)
            served.fresh = served.restart = False
            self.state = "load"
        elif self.state == "load":
            self.load(served, period)
        elif self.state == "divide":
            self.bits -= 1
            self.state = "divide" if self.bits else "give"
        else:
            self.state = "seek"
        if valid:
            it = self.axes[axis]
            it.target, it.fresh, it.restart = target, True, bool(restart_in or it.restart)
        if rst:
            self.reset()
        return out

    def begin(self, axis, restarts):
        self.restarts = restarts
        if restarts:
            self.distance, axis.end = 0, axis.target >> 16 << 16
        else:
            self.distance, axis.end = wrapped(axis.target - axis.end), axis.target

    def load(self, axis, period):
        found = rate_of(self.distance, axis.rest, period, self.rate_f)
        steep = found is TOO_FAR and not self.restarts
        self.rest = None
        if steep or self.restarts:
            self.given, self.state = (0, int(self.restarts), int(steep)), "give"
        else:
            rate, self.rest = found
            self.given, self.state, self.bits = (rate, 0, 0), "divide", self.rate_f + 1

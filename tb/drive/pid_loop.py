# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/pid_loop.sv in integers: clk(...) advances one cycle and returns (valid,
command) after it; at_limit is an attribute.
"""

PASS = 41  # cycles: one for each bit, and one to evaluate the result
# cycles after tick: the integral, the sum and the damped sum are complete
INTEGRATED, ADDED, DAMPED = 1 + PASS, 1 + 2 * PASS, 1 + 2 * PASS + 33
LATENCY = DAMPED + 1 + 16  # the command is given
RETAKEN = ADDED + PASS  # the same when the integral is retaken
NEAR = 1 << 30  # LSB: the change of an error that is further counts as 0


def held(x, most):
    return max(-most, min(most, x))


class PidLoop:
    def __init__(self):
        self.reset()

    def reset(self):
        self.n = None  # cycles since tick, None: waiting
        self.integral = self.command = self.fraction = 0  # fraction: 2^-16 command
        # there was no power since the inputs were taken; since the last computed command; the
        # power was off since the last command
        self.stale = self.fresh = self.stopped = 1
        self.changed = self.changed_taken = self.retaking = 0
        self.limited = 0  # +-1: integral and kp e were above the limit in the last tick
        self.at_limit = 0
        self.last_error = None  # of the last tick, None: it was not near

    def clk(
        self,
        rst=0,
        tick=0,
        power=0,
        closed_loop=0,
        kp=0,
        ki=0,
        kd=0,
        limit=0,
        gains_changed=0,
        target=0,
        position=0,
        open_command=0,
    ):
        """Advance one cycle."""
        if rst:
            self.reset()
            return 0, 0
        powerless, valid = not closed_loop or not power, 0
        no_power = bool(powerless or self.stale)
        if self.n is None:
            self.n = 0 if tick else None
        else:
            self.n += 1
        taken = self.n == 0
        if taken:
            self.kp, self.ki, self.kd, self.limit = kp, ki, kd, limit
            self.error = max(-1 << 31, min((1 << 31) - 1, target - position))
            self.changed_taken = self.changed
        elif self.n == INTEGRATED:
            blocked = self.limited == (-1 if self.error < 0 else 1)
            grown = self.integral + (0 if blocked else self.ki * self.error)
            self.integral = held(grown, self.limit << 24)
            changed = self.fresh or self.changed or self.changed_taken
            self.retaking = int(bool(changed and self.ki and not no_power))
        elif self.n == ADDED:
            total = (self.integral >> 8) + self.kp * self.error
            if self.retaking:
                last = 0 if self.stopped else (self.command << 16) + self.fraction
                self.integral = held(self.integral + (last - total << 8), self.limit << 24)
            self.limited = self.limit_sum(total, no_power)
            self.fresh = self.fresh and no_power
            near = -NEAR <= self.error < NEAR
            known = near and self.last_error is not None
            self.change = self.error - self.last_error if known else 0
            self.last_error = self.error if near else None
        elif self.n == DAMPED and not self.retaking:
            self.limit_sum((self.asked << 16) + self.fraction + self.kd * self.change, no_power)
        elif self.n == (RETAKEN if self.retaking else LATENCY):
            self.command = self.asked if closed_loop else open_command
            self.at_limit = int(not no_power and abs(self.asked) == self.limit)
            self.limited = self.limited if closed_loop else 0
            self.n, valid, self.stopped, self.retaking = None, 1, 0, 0
        elif self.n is not None and self.n > ADDED and self.stopped and no_power:
            self.asked = 0
        self.stale = int(bool(powerless or self.stale and not taken))
        self.changed = gains_changed or self.changed and not taken
        if not power:
            self.stopped = 1
        if powerless:
            self.fresh = 1
        if no_power:
            self.integral = self.fraction = 0
        return valid, self.command

    def limit_sum(self, total, no_power):
        """Limits the command, or holds the last one; returns +-1 if it was above its limit."""
        last = 0 if self.stopped else (self.command << 16) + self.fraction
        asked = last if no_power or self.retaking else total
        limited = (asked >> 16 > self.limit) - (asked >> 16 < -self.limit)
        asked = self.limit * limited << 16 if limited else asked
        self.asked, self.fraction = asked >> 16, asked & 0xFFFF
        return limited

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/pi_loop.sv in integers: clk(...) advances one cycle and returns (valid,
command) after it; at_limit is an attribute.
"""

PASS = 41  # cycles: one for each bit, and one to evaluate the result
INTEGRATED, ADDED = 1 + PASS, 1 + 2 * PASS  # cycles after tick: integral and sum are complete
LATENCY = ADDED + 1 + 16  # the command is given
RETAKING = PASS - 17  # cycles more when the integral is retaken


def held(x, most):
    return max(-most, min(most, x))


class PiLoop:
    def __init__(self):
        self.reset()

    def reset(self):
        self.n = None  # cycles since tick, None: waiting
        self.integral = self.command = self.fraction = 0  # fraction: 2^-16 command
        # there was no power since the inputs were taken; since the last computed command; the
        # power was off since the last command
        self.stale = self.fresh = self.stopped = 1
        self.changed = self.changed_taken = self.retaking = 0
        self.limited = 0  # +-1: the last command was above its limit
        self.at_limit = 0

    def clk(
        self,
        rst=0,
        tick=0,
        power=0,
        closed_loop=0,
        kp=0,
        ki=0,
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
            self.kp, self.ki, self.limit = kp, ki, limit
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
            last = 0 if self.stopped else (self.command << 16) + self.fraction
            if self.retaking:
                jump = last - total
                self.integral = held(self.integral + (jump << 8), self.limit << 24)
            asked = last if no_power or self.retaking else total
            self.limited = (asked >> 16 > self.limit) - (asked >> 16 < -self.limit)
            asked = self.limit * self.limited << 16 if self.limited else asked
            self.asked, self.fraction = asked >> 16, asked & 0xFFFF
            self.fresh = self.fresh and no_power
        elif self.n == LATENCY + self.retaking * RETAKING:
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

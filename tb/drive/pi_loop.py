# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/pi_loop.sv in integers: clk(...) advances one cycle and returns (valid,
command) after it.
"""

LOAD, PRODUCT = 1, 25  # cycles after tick: the first term is loaded; cycles of each term
INTEGRATE, LIMIT = LOAD + PRODUCT, LOAD + 2 * PRODUCT  # the integral is new, the sum is complete
LATENCY = LIMIT + 1


def held(x, low, high):
    return max(low, min(high, x))


class PiLoop:
    def __init__(self):
        self.reset()

    def reset(self):
        self.n = None  # cycles since tick, None: waiting
        self.integral = self.error = self.command = 0
        # there was no power since the inputs were taken; since the last command
        self.stale = self.fresh = 1
        self.changed = self.changed_taken = 0
        self.retaking = None  # the integral from which the command continues
        self.sum = 0  # 2^-16 command
        self.limited = set()  # directions in which the last command was at its limit

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
        """Advance one cycle. Gains and limits may change within a calculation with gains_changed
        only.
        """
        if rst:
            self.reset()
            return 0, 0
        powerless, valid, most = not closed_loop or not power, 0, limit << 24
        no_power = bool(powerless or self.stale)
        if self.n is None:
            self.n = 0 if tick else None
        else:
            self.n += 1
        taken = self.n == 0
        if taken:
            self.error = held(target - position, -1 << 31, (1 << 31) - 1)
            self.changed_taken = self.changed
        elif self.n == LOAD:
            blocked = (-1 if self.error < 0 else 1) in self.limited
            self.grown = (0 if powerless else self.integral) + (0 if blocked else ki * self.error)
        elif self.n == INTEGRATE:
            self.integral = held(self.grown, -most, most)
            self.total = (self.integral >> 8) + kp * self.error
        elif self.n == LIMIT:
            retakes = (self.fresh or self.changed or self.changed_taken or gains_changed) and ki
            asked = self.sum if no_power or retakes else self.total
            jump = self.sum - held(self.total, -1 << 33, (1 << 33) - 1)
            self.retaking = self.integral + (jump << 8) if retakes and not no_power else None
            self.limited = {(asked >> 16 > limit) - (asked >> 16 < -limit)} - {0}
            self.sum = (limit << 16) * sum(self.limited) if self.limited else asked
            self.limited = self.limited if closed_loop else set()
            self.fresh = self.fresh and no_power
        elif self.n == LATENCY:
            if self.retaking is not None:
                self.integral = held(self.retaking, -most, most)
            self.n, valid = None, 1
            command = self.sum >> 16
            self.limited |= {(command > limit) - (command < -limit)} - {0}
            self.limited = self.limited if closed_loop else set()
            self.command = held(command, -limit, limit) if closed_loop else open_command
        self.stale = int(bool(powerless or self.stale and not taken))
        self.changed = gains_changed or self.changed and not taken
        if powerless:
            self.fresh, self.integral, self.sum = 1, 0, self.command << 16 if power else 0
        return valid, self.command

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/pid_servo.sv in integers: clk(...) advances one cycle and returns the
outputs after it.
"""

from tb.control.biquad_cascade import STAGE, BiquadCascade

TAKE, LOAD, PRODUCT = 8, 9, 25  # cycles after tick: inputs taken, first term loaded; per term
INTEGRATE = LOAD + PRODUCT  # cycles after tick: the integral is new


def held(x, low, high):
    return max(low, min(high, x))


class PidServo:
    def __init__(self, terms=5, biquads=2):
        self.terms, self.biquads = terms, biquads
        self.limit = LOAD + PRODUCT * terms  # cycles after tick: the sum is complete
        self.latency = self.limit + 1 + STAGE * biquads
        self.filters = BiquadCascade(biquads)
        self.reset()

    def reset(self):
        self.n = None  # cycles since tick, None: waiting
        self.integral = self.error = self.command = self.saturated = 0
        self.stale = self.fresh = (
            1  # the drive was off since the inputs were taken; since the last command
        )
        self.changed = self.changed_taken = 0
        self.retaking = None  # the integral from which the command continues
        self.sum = 0  # 2^-16 command, before the filters
        self.limited = set()  # directions in which the last command was at its limit
        self.ready, self.filtered = 1, 0

    def clk(
        self,
        rst=0,
        tick=0,
        closed_loop=0,
        kp=0,
        ki=0,
        kd=0,
        kv=0,
        ka=0,
        output_limit=0,
        integral_limit=0,
        dead_band=0,
        gains_changed=0,
        filters_in_use=0,
        coefficient_write=0,
        coefficient_address=0,
        coefficient=0,
        target=0,
        target_velocity=0,
        target_acceleration=0,
        moving=0,
        position=0,
        velocity=0,
        open_command=0,
        block_up=0,
        block_down=0,
    ):
        """Advance one cycle. Gains and limits may change within a calculation with gains_changed
        only.
        """
        if rst:
            self.filters.clk(
                rst=1,
                coefficient_write=coefficient_write,
                coefficient_address=coefficient_address,
                coefficient=coefficient,
            )
            self.reset()
            return 0, 0, 0, 0
        off = block_up and block_down
        powerless, valid, limit = not closed_loop or off, 0, integral_limit << 24
        no_power = bool(powerless or self.stale)
        if self.n is None:
            self.n = 0 if tick and self.ready else None
        else:
            self.n += 1
        sample = {}
        if self.n == TAKE:
            self.error = held(target - position, -1 << 31, (1 << 31) - 1)
            rate = target_velocity - velocity
            products = [
                kp * self.error,
                kd * rate,
                kv * target_velocity,
                ka * target_acceleration << 8,
            ]
            self.total = sum(products[: self.terms - 1])
            self.moving, self.changed_taken = moving, self.changed
        elif self.n == LOAD:
            blocked = (
                block_down or -1 in self.limited
                if self.error < 0
                else block_up or 1 in self.limited
            )
            constant = blocked or not self.moving and abs(self.error) <= dead_band
            self.grown = (0 if powerless else self.integral) + (0 if constant else ki * self.error)
        elif self.n == INTEGRATE:
            self.integral = held(self.grown, -limit, limit)
            self.total += self.integral >> 8
        elif self.n == self.limit:
            retakes = (self.fresh or self.changed or self.changed_taken or gains_changed) and ki
            asked = self.sum if no_power or retakes else self.total
            jump = self.sum - held(self.total, -1 << 33, (1 << 33) - 1)
            self.retaking = self.integral + (jump << 8) if retakes and not no_power else None
            self.limited = (
                {1}
                if asked >> 16 > output_limit
                else {-1}
                if asked >> 16 < -output_limit
                else set()
            )
            self.sum = (output_limit << 16) * sum(self.limited) if self.limited else asked
            self.limited = self.limited if closed_loop else set()
            self.fresh = self.fresh and no_power
            self.filtered = self.sum
            sample = dict(
                valid_in=1, track=int(no_power), x=self.sum if closed_loop else open_command << 16
            )
        elif self.n is not None and self.n > self.limit:
            if self.retaking is not None:
                self.integral = held(self.retaking, -limit, limit)
            if self.n == self.latency:
                self.n, valid = None, 1
                command = (self.sum if no_power else self.filtered) >> 16
                self.limited |= {(command > output_limit) - (command < -output_limit)} - {0}
                self.limited = self.limited if closed_loop else set()
                self.saturated = int(bool(self.limited))
                self.command = (
                    held(command, -output_limit, output_limit) if closed_loop else open_command
                )
        if self.biquads:
            self.ready, _, self.filtered = self.filters.clk(
                in_use=filters_in_use & (1 << self.biquads) - 1,
                coefficient_write=coefficient_write,
                coefficient_address=coefficient_address,
                coefficient=coefficient,
                **sample,
            )
        self.stale = int(bool(powerless or self.stale and self.n != TAKE))
        self.changed = gains_changed or self.changed and self.n != TAKE
        if powerless:
            self.fresh, self.integral, self.sum = 1, 0, 0 if off else self.command << 16
        return valid, self.command, self.error, self.saturated

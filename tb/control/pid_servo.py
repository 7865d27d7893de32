# SPDX-License-Identifier: Apache-2.0
"""What rtl/control/pid_servo.sv does, in integers: clk(...) is one clk and returns what is on the pins after it."""

TAKE, LOAD, PRODUCT = 8, 9, 25          # clk after tick: inputs taken, first term loaded; clk per term
INTEGRATE = LOAD + PRODUCT              # the integral is new
LATENCY = LOAD + 5 * PRODUCT            # the command is new


def held(x, low, high):
    return max(low, min(high, x))


class PidServo:
    def __init__(self):
        self.reset()

    def reset(self):
        self.n = None                   # clk since tick, None: at rest
        self.integral = self.error = self.command = self.saturated = 0
        self.stale = 1                  # power was missing at some clk since the inputs were taken
        self.limited = 0                # direction in which the last command stood at its limit

    def clk(self, rst=0, tick=0, closed_loop=0, kp=0, ki=0, kd=0, kv=0, ka=0, output_limit=0, integral_limit=0, dead_band=0,
            target=0, target_velocity=0, target_acceleration=0, moving=0, position=0, velocity=0, open_command=0, block_up=0,
            block_down=0):
        """Gains and limits must not change within a calculation."""
        if rst:
            self.reset()
            return 0, 0, 0, 0
        powerless, valid = not closed_loop or (block_up and block_down), 0
        if self.n is None:
            self.n = 0 if tick else None
        else:
            self.n += 1
        self.stale = int(bool(powerless or self.stale and self.n != TAKE))
        if self.n == TAKE:
            self.error = held(target - position, -1 << 31, (1 << 31) - 1)
            self.sum = kp * self.error + kd * (target_velocity - velocity) + kv * target_velocity
            self.sum += ka * target_acceleration << 8
            self.moving = moving
        elif self.n == LOAD:
            blocked = block_down or self.limited < 0 if self.error < 0 else block_up or self.limited > 0
            rests = blocked or not self.moving and abs(self.error) <= dead_band
            self.grown = (0 if powerless else self.integral) + (0 if rests else ki * self.error)
        elif self.n == INTEGRATE:
            limit = integral_limit << 24
            self.integral = held(self.grown, -limit, limit)
            self.sum += self.integral >> 8
        elif self.n == LATENCY:
            self.n, valid, asked = None, 1, 0 if self.stale else self.sum >> 16
            self.command = held(asked, -output_limit, output_limit)
            self.limited = (asked > output_limit) - (asked < -output_limit) if closed_loop else 0
            self.saturated = int(self.limited != 0)
            if not closed_loop:
                self.command = open_command
        if powerless:
            self.integral = 0
        return valid, self.command, self.error, self.saturated

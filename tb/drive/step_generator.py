# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_generator.sv in integers: clk(...) advances one cycle and returns (step,
direction, pulse, upward, steps, overrun, stopped) after it.
"""

STEP_DIRECTION, QUADRATURE = 0, 1


def signed(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class Age:
    """Cycles since something began; it stops at its limit, and reset is long ago."""

    def __init__(self, bits):
        self.cycles = (1 << bits) - 1

    def over(self, limit):
        return self.cycles & limit == limit

    def clk(self, begins, over):
        self.cycles = 1 if begins else self.cycles + (not over)


class StepGenerator:
    def __init__(self, time_w=14, rate_f=36, ahead_w=10):
        self.time_w, self.rate_f, self.bits = time_w, rate_f, rate_f + ahead_w
        self.reset()

    def reset(self):
        self.level_age, self.direction_age = Age(self.time_w), Age(self.time_w)
        self.pulse = self.upward = self.turning = self.rewired = self.overrun = False
        self.quarter = self.steps = 0
        self.wiring = (0, 0, 0)  # mode, step_low and direction_low in force
        self.pins = (0, 0)
        self.stopped = True
        self.next = (0, 0, 0)  # rate, restart, steep
        self.restart()
        return self.shown()

    def restart(self):
        self.rate = 0
        self.ahead, self.reverses, self.acted = 0, False, self.upward

    def shown(self):
        own = int(self.pulse), int(self.upward)
        return *self.pins, *own, signed(self.steps, 32), int(self.overrun), int(self.stopped)

    def levels(self):
        """The levels of the pins in this state."""
        mode, step_low, direction_low = self.wiring
        if mode == STEP_DIRECTION:
            pins = self.pulse, self.upward
        elif mode == QUADRATURE:
            pins = self.quarter % 4 in (1, 2), self.quarter % 4 in (2, 3)
        else:
            pins = self.pulse and self.upward, self.pulse and not self.upward
        return int(pins[0]) ^ step_low, int(pins[1]) ^ direction_low

    def clk(
        self,
        rst=0,
        high_cycles=0,
        low_cycles=0,
        setup_cycles=0,
        hold_cycles=0,
        mode=0,
        step_low=0,
        direction_low=0,
        enable=0,
        line_start=0,
        line_idle=0,
        rate_valid=0,
        rate=0,
        rate_restart=0,
        rate_steep=0,
    ):
        _, next_restart, next_steep = self.next
        if rst:
            self.reset()
            if rate_valid:
                self.next = (rate, rate_restart, rate_steep)
            return self.shown()
        begins = line_start and next_restart
        restarts = not enable or self.stopped or begins
        follows = not (restarts or self.overrun or self.acted or self.rewired)
        level_over = self.level_age.over(high_cycles if self.pulse else low_cycles)
        direction_over = self.direction_age.over(setup_cycles if self.turning else hold_cycles)
        due = (self.ahead >= 0) == self.upward
        may_step = level_over and (direction_over or not self.turning)
        rise = follows and not self.pulse and due and may_step
        turns = follows and not self.pulse and direction_over and self.reverses and not due
        fall = self.pulse and level_over
        wiring = (mode, step_low, direction_low)
        standstill = not enable and not self.pulse and level_over and direction_over
        rewires = standstill and wiring != self.wiring

        # the line
        one = 1 << self.rate_f
        top = 1 << self.bits - 2
        if not restarts and (line_start and next_steep or not -top <= self.ahead < top):
            self.overrun = True
        if not enable or begins:
            self.overrun = False
        behind = self.ahead < -one if self.upward else self.ahead >= one
        self.reverses = not self.acted and behind
        back = self.acted * (-one if self.upward else one)
        self.ahead = signed(self.ahead + back + self.rate, self.bits)
        self.acted = rise or turns
        if line_start:
            self.rate, self.next = self.next[0], (0, 0, 0)
        if line_idle:
            self.rate = 0
        if rate_valid:
            self.next = (rate, rate_restart, rate_steep)
        if not enable or begins:
            self.stopped = not enable
        upward = self.upward
        if restarts:
            self.restart()

        # the pins
        self.level_age.clk(rise or fall or self.rewired, level_over)
        self.direction_age.clk(fall or turns or self.rewired, direction_over)
        self.steps += (1 if upward else -1) * rise
        self.quarter += (1 if upward else -1) * rise
        self.pulse = rise or (self.pulse and not fall)
        self.turning = turns or self.rewired or (self.turning and not rise)
        self.upward = upward != turns
        self.pins = self.levels()
        self.rewired = rewires
        if rewires:
            self.wiring = wiring
        return self.shown()

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_generator.sv in integers: clk(...) advances one cycle and returns (step,
direction, steps, overrun) after it.
"""

STEP_DIRECTION, QUADRATURE = 0, 1


def signed(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class StepGenerator:
    def __init__(self, period_w=18, ahead_w=6):
        self.period_w, self.bits = period_w, period_w + ahead_w + 16
        self.reset()

    def reset(self, target=0):
        self.line_cycles = 0
        self.level_timer = self.direction_timer = 0  # cycles left after the next
        self.pulse = self.upward = self.turning = self.rewired = False
        self.quarter = self.steps = 0
        self.wiring = (0, 0, 0)  # mode, step_low and direction_low in force
        self.pins = (0, 0)
        self.restart(target)
        return self.shown()

    def restart(self, target):
        self.line_end = target >> 16 << 16
        self.left = 0  # cycles left of the line, after the next
        self.slope = self.ahead = 0
        self.waiting = self.reverses = self.overrun = False
        self.acted = self.upward

    def shown(self):
        return *self.pins, signed(self.steps, 32), int(self.overrun)

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
        period=0,
        high_cycles=0,
        low_cycles=0,
        setup_cycles=0,
        hold_cycles=0,
        mode=0,
        step_low=0,
        direction_low=0,
        enable=0,
        load=0,
        tick=0,
        target=0,
    ):
        if rst:
            return self.reset(target)
        follows_target = enable and not load and self.line_cycles > 0
        follows = follows_target and not (self.overrun or self.acted or self.rewired)
        level_over, direction_over = self.level_timer <= 0, self.direction_timer <= 0
        due = (self.ahead >= 0) == self.upward
        may_step = level_over and (direction_over or not self.turning)
        rise = follows and not self.pulse and due and may_step
        turns = follows and not self.pulse and direction_over and self.reverses and not due
        fall = self.pulse and level_over
        wiring = (mode, step_low, direction_low)
        standstill = not enable and not self.pulse and level_over and direction_over
        rewires = standstill and wiring != self.wiring

        # the line
        whole = self.line_cycles << 16
        moved = signed(self.ahead + (-whole if self.upward == self.acted else whole), self.bits)
        self.reverses = not self.acted and (moved < 0) == self.upward
        top = 1 << self.bits - 2
        too_steep = not -1 << self.period_w + 16 <= self.slope < 1 << self.period_w + 16
        self.overrun = self.overrun or too_steep or not -top <= self.ahead < top
        self.ahead = signed((moved if self.acted else self.ahead) + self.slope, self.bits)
        self.acted = rise or turns
        if (tick or self.waiting) and self.left <= 0:
            self.slope, self.line_end = signed(target - self.line_end, 48), target
            self.left, self.waiting = self.line_cycles - 1, False
        else:
            self.slope = 0 if self.left <= 0 else self.slope
            self.left, self.waiting = self.left - 1, bool(tick or self.waiting)
        upward = self.upward
        if not follows_target:
            self.restart(target)
            self.line_cycles = period

        # the pins
        self.level_timer = (
            (high_cycles if rise else low_cycles) - 1
            if rise or fall or self.rewired
            else self.level_timer - 1
        )
        self.direction_timer = (
            (hold_cycles if fall else setup_cycles) - 1
            if fall or turns or self.rewired
            else self.direction_timer - 1
        )
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

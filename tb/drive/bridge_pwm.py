# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/bridge_pwm.sv in integers: clk(...) advances one cycle and returns the pins
after it.
"""

MULTIPLY = 8  # cycles from taking a command to its product


class BridgePwm:
    def __init__(self):
        self.off()

    def off(self):
        self.asked = None  # [cycles left, command, period]
        self.command = self.period = 0  # taken at the next border
        self.left = self.on_left = self.fraction = (
            0  # of the running period; fraction in 2^-15 cycle
        )
        self.negative = self.powered = False
        return 0, 0

    def clk(self, rst=0, enable=1, period=0, valid=0, command=0):
        if rst or not enable:
            return self.off()
        if self.left == 0:
            on, self.fraction = divmod(abs(self.command) * self.period + self.fraction, 1 << 15)
            self.left, self.on_left, self.negative = max(0, self.period - 1), on, self.command < 0
            self.powered = self.period > 0
        else:
            self.left -= 1
        drives = self.on_left > 0
        self.on_left -= drives
        if valid:
            self.asked = [MULTIPLY, command, period]
        elif self.asked:
            self.asked[0] -= 1
            if self.asked[0] == 0:
                (_, self.command, self.period), self.asked = self.asked, None
        return int(self.powered and not (drives and self.negative)), int(
            self.powered and (not drives or self.negative)
        )

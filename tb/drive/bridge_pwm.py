# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/bridge_pwm.sv in integers: clk(...) advances one cycle and returns the pins
after it.
"""


class BridgePwm:
    def __init__(self):
        self.off()

    def off(self):
        self.asked = self.next = 0, 0  # command and period: as asked, at the next border
        self.period = self.left = self.on_left = 0  # of the running period, cycles
        self.fraction = 0  # 2^-15 cycle
        self.negative = False
        return 0, 0

    def clk(self, rst=0, enable=1, period=0, valid=0, command=0):
        if rst or not enable:
            return self.off()
        powered, drives, negative = self.period > 0, self.on_left > 0, self.negative
        self.left, self.on_left = max(0, self.left - 1), max(0, self.on_left - 1)
        if self.left == 0:
            command_now, self.period = self.next
            on = abs(command_now) * self.period + self.fraction
            self.on_left, self.fraction = divmod(on, 1 << 15)
            self.left, self.negative = self.period, command_now < 0
        self.next = self.asked
        if valid:
            self.asked = command, period
        return int(powered and not (drives and negative)), int(powered and (not drives or negative))

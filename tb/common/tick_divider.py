# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/common/tick_divider.sv: step(period, restart) advances one cycle and returns tick
after it.
"""


class TickDivider:
    def __init__(self):
        self.elapsed = 0

    def step(self, period, restart=0, rst=0):
        if rst or restart or period == 0:
            self.elapsed = 0
            return 0
        self.elapsed += 1
        tick = int(self.elapsed >= period)
        if tick:
            self.elapsed = 0
        return tick

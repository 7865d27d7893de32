# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/drive/step_line.sv in integers: line(...) is what it reports in this cycle, clk(...)
then advances one cycle.
"""


class StepLine:
    def __init__(self):
        self.reset()

    def reset(self):
        self.given, self.fresh, self.lost = False, True, True
        self.target = self.up = self.down = 0

    def line(self, enable=0, tick=0, **_):
        """(go, restart)"""
        if not (tick and self.given):
            return 0, 0
        restart = int(self.fresh or not enable)
        return 1 - restart, restart

    def clk(self, rst=0, enable=0, tick=0, valid=0, restart_in=0, target_in=0, up_in=0, down_in=0):
        if valid:
            self.target, self.given = target_in, True
            self.fresh = bool(restart_in or self.lost)
        if not enable:
            self.fresh = True
        self.lost = not enable or (self.lost and not tick)
        if tick:
            self.up, self.down = up_in, down_in
        if rst:
            self.reset()

# SPDX-License-Identifier: Apache-2.0
"""What rtl/position/shift_delay.sv does, in integers: clk(...) is one cycle and returns (shifted,
shifted_periods) after it; periods are None before the first shift.
"""


class ShiftDelay:
    def __init__(self):
        self.periods = None

    def clk(self, shift, shift_periods, rst=0):
        if shift:
            self.periods = shift_periods
        return int(shift and not rst), self.periods

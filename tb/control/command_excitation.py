# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/command_excitation.sv: excited() is the result as it passes now, step()
advances one cycle.
"""

COMMAND = 5


class CommandExcitation:
    def __init__(self, depth=4096):
        self.depth, self.waveform = depth, [None] * depth
        self.at, self.value = 0, None

    def first(self):
        return int(self.at == 0)

    def adds(self, axis, period, running, valid, result_axis, kind):
        return valid and period != 0 and running and kind == COMMAND and result_axis == axis

    def excited(
        self, axis=0, period=0, running=1, limit=0, valid=0, result_axis=0, kind=0, result=0
    ):
        if not self.adds(axis, period, running, valid, result_axis, kind):
            return result
        low = (result + (1 << 15)) % (1 << 16) - (1 << 15)
        return max(-limit, min(limit, low + self.value))

    def step(
        self,
        axis=0,
        period=0,
        running=1,
        valid=0,
        result_axis=0,
        kind=0,
        store=0,
        store_at=0,
        store_value=0,
        rst=0,
        **_,
    ):
        self.value = self.waveform[self.at % self.depth]
        if store:
            self.waveform[store_at % self.depth] = store_value
        if rst or period == 0 or not running:
            self.at = 0
        elif self.adds(axis, period, running, valid, result_axis, kind):
            self.at = self.at + 1 if self.at + 1 < period else 0

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/status_inputs.sv: step(...) advances one cycle and returns the lists level,
rose, fell after it.
"""

from tb.common.synchroniser import Synchroniser

SETTLE = 4  # cycles after reset in which the level follows the input


class StatusInputs:
    def __init__(self, clk_hz, w=2):
        self.ms, self.w, self.age = clk_hz // 1000, w, 0  # age: cycles since reset
        self.synchroniser = Synchroniser(w, name="status_inputs.u_inputs")
        self.now, self.level, self.stable = [0] * w, [0] * w, [0] * w

    def step(self, time_ms, inputs, rst=0):
        before, running = self.level, not rst and self.age >= SETTLE
        end = self.age % self.ms == self.ms - 1
        if not running:
            self.level, self.stable = list(self.now), [0] * self.w
        else:
            ripe = [
                now != level and end and stable >= time_ms
                for now, level, stable in zip(self.now, self.level, self.stable)
            ]
            self.stable = [
                stable + end if now != level and not passes else 0
                for now, level, stable, passes in zip(self.now, self.level, self.stable, ripe)
            ]
            self.level = [
                now if passes else level for now, level, passes in zip(self.now, self.level, ripe)
            ]
        self.age = 0 if rst else self.age + 1
        word = self.synchroniser.step(sum(level << n for n, level in enumerate(inputs)), rst)
        self.now = [word >> n & 1 for n in range(self.w)]
        return (
            self.level,
            [int(running and level > old) for level, old in zip(self.level, before)],
            [int(running and level < old) for level, old in zip(self.level, before)],
        )

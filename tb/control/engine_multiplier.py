# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_multiplier.sv: clk(x, y) advances one cycle and returns product after
it.
"""


class EngineMultiplier:
    def clk(self, x=0, y=0):
        return x * y

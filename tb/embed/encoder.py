# SPDX-License-Identifier: Apache-2.0
"""An incremental encoder at the pins of an example."""

from cocotb.triggers import ClockCycles

GRAY = ((0, 0), (1, 0), (1, 1), (0, 1))  # a, b going up


class Encoder:
    """Moves the pins of an encoder by counts."""

    def __init__(self, dut):
        self.dut, self.count = dut, 0
        dut.encoder_a.value = dut.encoder_b.value = 0

    async def move(self, counts, cycles):
        """Move, with so many cycles between two edges."""
        for _ in range(abs(counts)):
            self.count += 1 if counts > 0 else -1
            self.dut.encoder_a.value, self.dut.encoder_b.value = GRAY[self.count % 4]
            await ClockCycles(self.dut.clk, cycles)

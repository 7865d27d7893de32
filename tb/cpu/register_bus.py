# SPDX-License-Identifier: Apache-2.0
"""What rtl/cpu/register_bus.sv does, in integers."""


class RegisterBus:
    def __init__(self, axes=1):
        self.axes, self.chosen = axes, None

    def selects(self, select, address):
        """(node, line, axes as a bit mask) in the clk of the access."""
        block = address >> 8 if select else -1
        return int(block == 0), int(block == 1), 1 << block - 4 if 4 <= block < 4 + self.axes else 0

    def step(self, select, address):
        """One clk: the block whose answer passes from now on."""
        self.chosen = self.selects(select, address)

    def rdata(self, node, line, axes):
        """What the soft core reads, given the answers of the blocks."""
        if self.chosen is None:
            return None
        of_node, of_line, of_axes = self.chosen
        return (node if of_node else 0) | (line if of_line else 0) | sum(axes[n] for n in range(self.axes) if of_axes >> n & 1)

# SPDX-License-Identifier: Apache-2.0
"""What rtl/cpu/register_bus.sv does, in integers."""


class RegisterBus:
    def __init__(self, axes=1):
        self.axes, self.chosen = axes, None

    def selects(self, select, address):
        """(node, line, links, then axes, gratings and actuators as bit masks) in the clk of the
        access.
        """
        block = address >> 8 if select else -1

        def one_of(first):
            return 1 << block - first if first <= block < first + self.axes else 0

        return int(block == 0), int(block == 1), int(block == 2), one_of(4), one_of(12), one_of(20)

    def step(self, select, address):
        """One clk: the block whose answer passes from now on."""
        self.chosen = self.selects(select, address)

    def rdata(self, node, line, links, *answers):
        """What the soft core reads, given the answers of the blocks: node, line, links, and of each
        axis its three.
        """
        of_node, of_line, of_links, *of_axes = self.chosen
        several = [
            words[n] * (mask >> n & 1)
            for words, mask in zip(answers, of_axes, strict=True)
            for n in range(self.axes)
        ]
        return node * of_node | line * of_line | links * of_links | sum(several)

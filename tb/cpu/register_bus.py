# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/register_bus.sv in integers."""


class RegisterBus:
    def __init__(self, axes=1):
        self.axes, self.chosen = axes, None

    def selects(self, select, address):
        """Return the selects of node, bus and peripherals, then of axes, feedback channels and
        actuators as bit masks, in the cycle of the access.
        """
        block = address >> 8 if select else -1

        def one_of(first):
            return 1 << block - first if first <= block < first + self.axes else 0

        return int(block == 0), int(block == 1), int(block == 2), one_of(4), one_of(12), one_of(20)

    def step(self, select, address):
        """Advance one cycle: the answer of the selected block passes from now on."""
        self.chosen = self.selects(select, address)

    def rdata(self, node, bus, peripherals, *answers):
        """What the soft core reads, given the answers of the blocks: node, bus, peripherals, and
        the three of each axis.
        """
        of_node, of_bus, of_peripherals, *of_axes = self.chosen
        several = [
            words[n] * (mask >> n & 1)
            for words, mask in zip(answers, of_axes, strict=True)
            for n in range(self.axes)
        ]
        single = node * of_node | bus * of_bus | peripherals * of_peripherals
        return single | sum(several)

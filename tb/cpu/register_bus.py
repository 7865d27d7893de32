# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/cpu/register_bus.sv in integers."""


class RegisterBus:
    def __init__(self, axes=1):
        self.axes, self.rdata, self.accessed = axes, 0, 0
        self.block = 0  # of the address of the cycle before

    def selects(self, select):
        """Return the selects of node, bus, peripherals and link, then of axes, feedback channels
        and actuators as bit masks, in the cycle of the access.
        """
        block = self.block if select else -1

        def one_of(first):
            return 1 << block - first if first <= block < first + self.axes else 0

        return *(int(block == n) for n in range(4)), one_of(4), one_of(12), one_of(20)

    def step(self, select, address, memory, node, bus, peripherals, link, *several):
        """Advance one cycle with an access and the answers to the one before: of the register
        memory, of the blocks of the node, and of the three blocks of each axis.
        """
        if self.accessed:
            self.rdata = memory | node | bus | peripherals | link
            for word in (word for words in several for word in words):
                self.rdata |= word
        self.accessed, self.block = select, address >> 8

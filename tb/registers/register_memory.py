# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/register_memory.sv in integers."""

from tb.registers.register_layout import RegisterLayout

FILL = 2048  # cycles from the end of rst to ready


class RegisterMemory:
    def __init__(self, axes=1, built=None):
        self.layout = RegisterLayout(axes, built)
        self.memory = [0] * self.layout.words
        self.rdata = 0
        self.reset()

    def reset(self):
        self.count, self.commit, self.wdata_low = 0, None, 0

    @property
    def ready(self):
        return int(self.count == FILL)

    def stores(self, hold=0, select=0, write=0, address=0, wdata=0, **_):
        """(word, value) that is stored in this cycle, or None; a low word waits."""
        if not self.ready:
            return None if hold else (self.count, self.layout.first(self.count))
        if select and write and not self.layout.low(address):
            return address, self.layout.stored_bits(address, wdata)
        return None

    def step(self, hold=0, select=0, write=0, address=0, wdata=0, rst=0):
        """Advance one cycle; there is no access while ready is low, and none after the write of a
        high word.
        """
        layout = self.layout
        if not self.ready:
            self.memory[layout.place(self.count)] = layout.first(self.count)
        elif self.commit is not None:
            self.memory[self.commit] = self.wdata_low
        elif select and write and not layout.low(address):
            self.memory[layout.place(address)] = layout.stored_bits(address, wdata)
        elif select and not write:
            self.rdata = self.memory[layout.place(address)]
        self.commit = None
        if select and write and layout.low(address):
            self.wdata_low = wdata
        elif select and write and layout.high(address):
            self.commit = layout.place(address) - 1
        self.count += not self.ready and not hold
        if rst:
            self.reset()

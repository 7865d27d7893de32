# SPDX-License-Identifier: Apache-2.0
"""The registers of an axis by their names, for a test that is the master of the bus."""

from moire.made.registers import BLOCKS, BY_NAME


def fields(block, register):
    return [f for f in BY_NAME.values() if (f.block, f.register) == (block, register)]


class AxisRegisters:
    """master: an object with `read(address)` and `write(address, word)`; base: byte address of the
    register map on its bus.
    """

    def __init__(self, master, base=0):
        self.master, self.base = master, base

    async def get(self, block, register, field="value"):
        """The value of a field, of up to 64 bits."""
        f = BY_NAME[block, register, field]
        word = await self.master.read(self.base + f.address())
        if f.width > 32:
            word |= await self.master.read(self.base + f.address() + 4) << 32
        value = word >> f.low & (1 << f.width) - 1
        return value - (1 << f.width) if f.signed and value >> f.width - 1 else value

    async def put(self, block, register, **values):
        """Write a register; its other fields become 0."""
        word = 0
        for name, value in values.items():
            f = BY_NAME[block, register, name]
            word |= (value & (1 << f.width) - 1) << f.low
        address = self.base + BLOCKS[block][0] + fields(block, register)[0].offset
        await self.master.write(address, word & 0xFFFFFFFF)

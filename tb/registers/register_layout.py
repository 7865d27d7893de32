# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/register_layout.sv in integers."""

from tables import registers as tables
from tb.registers.register_block import WORD, extend


class RegisterLayout:
    """`built` gives the mask of a parameter by its name: bit n is set if axis n has it, as all axes
    have if it is not given. A setting that needs what its axis has not has no bits.
    """

    def __init__(self, axes=1, built=None):
        self.built, self.entries, self.slots = built or {}, {}, {}
        blocks = [b for b in tables.read(axes) if any(r.stored for r in b.registers)]
        of_axes = [b for b in blocks if b.count > 1 or b.stride]
        self.bits = (len(blocks) - len(of_axes) + len(of_axes) * axes - 1).bit_length()
        for index, block in enumerate(blocks):
            for n in range(block.count):
                base = (block.base + n * block.stride) // 4
                self.slots[base >> 6] = index + n * len(of_axes)
                for r in block.registers:
                    for high in range(1 + r.wide):
                        self.entries[base + r.word + high] = r, high, n
        self.words = 1 << self.bits + 6

    def place(self, address):
        slot = self.slots.get(address >> 6, (1 << self.bits) - 1)
        return slot << 6 | address & 63

    def settings(self, register):
        """The settings of a register that are read back."""
        return [f for f in register.fields if f.kind == "setting" and "r" in f.access]

    def there(self, register, axis):
        return [f for f in self.settings(register) if self.has(f, axis)]

    def has(self, field, axis):
        return not field.needs or self.built.get(field.needs, 255) >> axis & 1

    def first(self, address):
        register, high, axis = self.entries.get(address, (None, 0, 0))
        fields = self.there(register, axis) if register else ()
        return sum(f.reset << f.low for f in fields) >> 32 * high & WORD

    def low(self, address):
        register, high, _ = self.entries.get(address, (None, 0, 0))
        return bool(
            register and register.wide and register.fields[0].kind == "setting" and not high
        )

    def high(self, address):
        register, high, axis = self.entries.get(address, (None, 0, 0))
        return bool(register and high and self.there(register, axis))

    def stored_bits(self, address, wdata):
        """What a write to the word stores; of a low word nothing."""
        register, high, axis = self.entries.get(address, (None, 0, 0))
        if not register or register.wide and not high:
            return 0
        whole = 0
        for f in self.there(register, axis):
            signed = f.signed and len(register.fields) == 1
            if register.wide:
                return extend(wdata << 32, f.width, signed, 64) >> 32
            whole |= extend(wdata >> f.low, f.width, signed, 32 - f.low) << f.low
        return whole


def parameters():
    """The names of the masks."""
    return tables.layout(tables.read()).parameters


def built_of(dut):
    """The masks that a module was built with."""
    return {name: int(getattr(dut, name).value) for name in parameters()}

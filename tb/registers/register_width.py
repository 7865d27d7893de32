# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/registers/register_width.sv."""

from moire.made.registers import BLOCKS
from tables import registers as tables

AXES = 8  # that the map has room for


def low_words():
    """The addresses, in words, of the low words of all registers of 64 bits."""
    blocks = {block.name: block for block in tables.read(AXES)}
    return {
        (base + axis * stride) // 4 + register.word
        for name, (base, stride) in BLOCKS.items()
        for axis in range(AXES if stride else 1)
        for register in blocks[name].registers
        if register.wide
    }

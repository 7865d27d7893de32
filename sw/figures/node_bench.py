# SPDX-License-Identifier: Apache-2.0
"""A Verilated node whose soft core runs a small program instead of the firmware: it reads and
writes registers, as the client of a node does.
"""

from collections.abc import Mapping

from moire.made.registers import FIELDS
from mutation.library import MAILBOX, PROGRAM, Bench

START_CYCLES = 8192  # after which the settings of all axes are cleared
WORD = 0xFFFF_FFFF
OCCUPY = (  # at the beginning of the loop of PROGRAM
    0x00042283,  # lw t0, 0(s0)
    0xFFDFF06F,  # j -4
)
LOOP = 3  # word of PROGRAM where its loop begins


class NodeBench(Bench):
    """A node, or a design around it. Its registers have the names that the client has."""

    def begin(self, axes: int, **pins: int) -> None:
        """Loads the program and ends the reset, with these levels of inputs."""
        self.axes = axes
        self.load([*PROGRAM, *[0] * (MAILBOX + 4 - len(PROGRAM))])
        self.set(rst=1, drive_fault_n=(1 << axes) - 1, **pins)
        self.run(16)
        self.set(rst=0)
        self.run(START_CYCLES)

    def read_named(self, name: str, axis: int = 0) -> Mapping[str, int]:
        """The fields of a register, `block.name`."""
        known = [f for f in FIELDS if f"{f.block}.{f.register}" == name]
        word = self.access(known[0].address(axis))
        return {f.field: f.value(word) for f in known}

    def write_named(self, name: str, axis: int = 0, **values: int) -> None:
        """Writes the fields of a register, the others 0."""
        known = [f for f in FIELDS if f"{f.block}.{f.register}" == name]
        word = sum((values.get(f.field, 0) & (1 << f.width) - 1) << f.low for f in known)
        self.access(known[0].address(axis), word & WORD)

    def occupy_bus(self) -> None:
        """From now on the soft core only reads a register, again and again."""
        self.load([*PROGRAM[:LOOP], *OCCUPY, *PROGRAM[LOOP + len(OCCUPY) :]])

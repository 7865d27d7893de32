# SPDX-License-Identifier: Apache-2.0
"""One controller on the bus: its axes, its counters and its registers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from moire.client.axis import Axis
from moire.client.names import CAUSE_CODES
from moire.client.records import Progress, Status
from moire.client.update import Firmware, UpdateState, update
from moire.client.update import Progress as UpdateProgress
from moire.errors import OutOfRange, Refused, UnknownName, with_more
from moire.made.registers import FIELDS, Field
from moire.nearest import unknown

if TYPE_CHECKING:
    from moire.client.bus import Bus

END_OF_MAP = 65536  # bytes


class Node:
    """One controller on the bus. Bus.node() makes it."""

    def __init__(self, bus: Bus, address: int):
        self.bus, self.address = bus, address
        self.identity = bus.identify(address)
        self.identity.check()
        self.axes: dict[int, Axis] = {}
        self.switched_on: set[int] = set()  # axes whose drive this host has switched on

    def request(self, operation: str, **fields: int) -> dict[str, int]:
        """Sends one request; see Bus.request()."""
        return self.bus.request(self.address, operation, **fields)

    def axis(self, number: int = 0) -> Axis:
        """An axis of this node; raises Refused if there is none of this number."""
        if not 0 <= number < self.identity.axes:
            code = CAUSE_CODES["no_such_axis"]
            known = (
                "only axis 0" if self.identity.axes == 1 else f"axes 0 to {self.identity.axes - 1}"
            )
            raise Refused(
                "no_such_axis", code, f"node {self.address} has no axis {number}: it has {known}"
            )
        if number not in self.axes:
            self.axes.setdefault(number, Axis(self, number))  # another thread may have been faster
        return self.axes[number]

    def start(self, *axes: int, progress: Progress | None = None) -> list[Status]:
        """Begins the prepared motions of these axes in the same tick, or none of them.

        Returns the Status of each axis when all motions have ended; `progress` is called with a
        Status from time to time. Whatever interrupts the wait stops all axes under control first.
        """
        if not axes:
            raise OutOfRange("no axis is given: give the numbers of the axes that shall start")
        moving = [self.axis(number) for number in dict.fromkeys(axes)]
        self.request("start", axes=sum(1 << axis.number for axis in moving))
        try:
            return [axis.wait(progress) for axis in moving]
        except BaseException:
            for axis in moving:
                axis.stop_if_enabled()
            raise

    def counters(self) -> dict[str, int]:
        """What the node has met on the bus: frames, errors and others, by name."""
        return self.request("counters")

    def update(
        self, firmware: Firmware | str | Path, progress: UpdateProgress | None = None
    ) -> UpdateState:
        """Writes new firmware into the node and starts it; see moire.client.update.

        The firmware may be a file. Its axes must be set up again afterwards, as after power-up.
        """
        state = update(self.bus, self.address, firmware, progress)
        self.identity = self.bus.identify(self.address)
        self.axes.clear()
        return state

    # registers

    def read_register(self, address: int) -> int:
        """One 32-bit word of the register map, by its byte address."""
        if address % 4 or not 0 <= address < END_OF_MAP:
            raise OutOfRange(
                f"{address:#x} is no register address: allowed are multiples of 4 from 0 to 0xfffc"
            )
        try:
            return self.request("read_register", address=address)["value"]
        except Refused as refused:
            raise with_more(refused, f"address {address:#06x}") from None

    def write_register(self, address: int, value: int) -> None:
        """Writes one 32-bit word. The node takes only index, capture and compare registers."""
        if address % 4 or not 0 <= address < END_OF_MAP or not 0 <= value < 1 << 32:
            raise OutOfRange(
                f"{value:#x} cannot be written to {address:#x}: allowed are 32-bit words, and "
                "multiples of 4 from 0 to 0xfffc"
            )
        try:
            self.request("write_register", address=address, value=value)
        except Refused as refused:
            raise with_more(refused, f"address {address:#06x}") from None

    def write_named(self, name: str, axis: int = 0, **counts: int) -> None:
        """Writes a whole register by its fields; fields that are not given become 0.

        The low word of a wide register is written first.
        """
        fields = {
            known.field: known for known in FIELDS if f"{known.block}.{known.register}" == name
        }
        word = sum(
            (count & (1 << fields[field].width) - 1) << fields[field].low
            for field, count in counts.items()
        )
        known = next(iter(fields.values()))
        self.write_register(known.address(axis), word & 0xFFFFFFFF)
        if known.width > 32:
            self.write_register(known.address(axis) + 4, word >> 32)

    def read_named(self, name: str, axis: int = 0) -> dict[str, int]:
        """The fields of a register in counts, such as those of "axis.position"."""
        fields = register_fields(name)
        address = fields[0].address(axis)
        word = self.read_register(address)
        if max(field.low + field.width for field in fields) > 32:
            # reading the low word has latched the high one
            word |= self.read_register(address + 4) << 32
        return {field.field: field.value(word) for field in fields}


def register_fields(name: str) -> list[Field]:
    """The fields of a readable register; raises UnknownName or OutOfRange."""
    fields = [known for known in FIELDS if f"{known.block}.{known.register}" == name]
    if not fields:
        known = dict.fromkeys(f"{known.block}.{known.register}" for known in FIELDS)
        raise UnknownName(unknown("register", name, known, "docs/registers.md"))
    if not any("r" in known.access for known in fields):
        raise OutOfRange(f"the register {name} can only be written")
    return fields

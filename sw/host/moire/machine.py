# SPDX-License-Identifier: Apache-2.0
"""A machine by its port and the names of its axes.

    with moire.connect("twin:s2") as machine:
        with machine.axis("x").enabled() as x:
            x.home()
            print(x.move("1.5 mm").position_nm)

The names are those of machine.toml (moire.description), or of a simulated machine; "1.0" is axis 0
of node 1 everywhere. moire.aio has the same for asyncio.
"""

from types import TracebackType
from typing import Self

from moire import units
from moire.bus.transport import BAUD, Transport, open_bus
from moire.client.axis import Axis
from moire.client.bus import ANSWER_S, TRIES, Bus
from moire.client.node import Node
from moire.client.records import Identity
from moire.description import Description, describe
from moire.errors import MoireError, PortError


class Machine:
    """All axes of one bus. As a context manager it closes its port at the end, after each drive has
    been switched off that was switched on by it.
    """

    def __init__(self, bus: Bus, description: Description):
        self.bus, self.description = bus, description

    def axis(self, name: str) -> Axis:
        """An axis by its name, or by node and axis such as "1.0"; raises UnknownName."""
        return self.bus.axis(*self.description.axis(name).place)

    def axes(self) -> dict[str, Axis]:
        """The named axes, in the order of the description."""
        return {name: self.axis(name) for name in self.description.axes}

    def node(self, address: int = 1) -> Node:
        """A node by its address; see Bus.node()."""
        return self.bus.node(address)

    def find(self) -> list[Identity]:
        """The nodes that answer; see Bus.find()."""
        return self.bus.find()

    def close(self) -> None:
        """Switches off what was switched on, and closes the port.

        A drive that cannot be switched off does not keep the others on; the first error is raised
        at the end.
        """
        errors: list[MoireError] = []
        try:
            for node in self.bus.nodes.values():
                for number in sorted(node.switched_on):
                    node.axis(number).stop_if_enabled()
                    try:
                        node.axis(number).disable()
                    except MoireError as error:
                        errors.append(error)
        finally:
            self.bus.transport.close()
        if errors:
            raise errors[0]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except MoireError:
            if error is None:  # otherwise that one explains more
                raise


def opened(
    port: str | None, machine_file: str | None, baud: int, parity: str
) -> tuple[Transport, Description]:
    """The transport and the description of a machine; raises PortError, BadFile or UnknownName."""
    description = describe(machine_file).of(port)
    if description.port is None:
        raise PortError("no port: name one, in the call, in MOIRE_PORT or in machine.toml")
    return open_bus(description.port, baud, parity), description


def connect(
    port: str | None = None,
    *,
    machine_file: str | None = None,
    baud: int = BAUD,
    parity: str = "auto",
    tries: int = TRIES,
    patience: units.Value = ANSWER_S,
) -> Machine:
    """The machine at a port: "/dev/ttyUSB0", "socket://host:2218", "twin", "twin:s2" … Without one
    it is the port of the variable MOIRE_PORT, or else of machine.toml.

    `machine_file` is another file than the machine.toml that is found by itself. A request is sent
    `tries` times, each with this `patience` (s, or a text such as "0.2s"). Raises PortError,
    BadFile or UnknownName.
    """
    transport, description = opened(port, machine_file, baud, parity)
    answer_s = float(units.parse_time(patience))
    return Machine(Bus(transport, tries=tries, answer_s=answer_s), description)

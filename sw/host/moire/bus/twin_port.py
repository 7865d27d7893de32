# SPDX-License-Identifier: Apache-2.0
"""The ports "twin" and "twin:s2": simulated machines, which a checkout of Moire provides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from moire.errors import TwinNotBuilt, UnknownName

if TYPE_CHECKING:
    from moire.bus.transport import Transport

PORT = "twin"
DEFAULT = "s0"
MACHINES = {  # made by experiments.machines
    "s0": "X-Y stage with a grating interferometer, one node per axis",
    "s0_fine": "X axis of the stage s0 with a piezo on its table",
    "s2": "three stepper axes with scales in one node",
    "s3": "linear motor with a scale and its reference mark",
    "s4": "indexing table and wire-EDM machine, node 1 with the panel, node 2 with the table",
}
AXES = {  # names of their axes: address of the node, and number of the axis
    "s0": {"x": (1, 0), "y": (2, 0)},
    "s0_fine": {"x": (1, 0)},
    "s2": {"x": (1, 0), "y": (1, 1), "z": (1, 2)},
    "s3": {"x": (1, 0)},
    "s4": {"table": (2, 0)},
}


def machine_of(port: str) -> str | None:
    """The machine that a port names: "twin" is s0, "twin:s2" is s2; None for any other port.

    Raises UnknownName for a machine that does not exist.
    """
    kind, _, name = port.partition(":")
    if kind != PORT:
        return None
    if name and name not in MACHINES:
        raise UnknownName(
            f"there is no simulated machine '{name}': known are {', '.join(MACHINES)}"
        )
    return name or DEFAULT


def open_twin(baud: int, machine: str = DEFAULT, seed: int = 1, **settings: Any) -> Transport:
    """The transport of a simulated machine; raises TwinNotBuilt where none is installed.

    A checkout of Moire offers it as the entry point `twin` of the group `moire.ports`.
    """
    open_port = of_checkout("moire.ports", PORT, "the simulated machine")
    transport: Transport = open_port(machine, seed, **settings)
    transport.set_baud(baud)
    return transport


def of_checkout(group: str, name: str, what: str) -> Any:
    """What a checkout of Moire offers as an entry point; raises TwinNotBuilt where none is
    installed.
    """
    from importlib.metadata import entry_points  # loading it takes an eighth of a short command

    found = tuple(entry_points(group=group, name=name))
    if not found:
        raise TwinNotBuilt(
            f"{what} needs a checkout of Moire: run `make demo` there and use its "
            "build/venv/bin/moire"
        )
    return found[0].load()

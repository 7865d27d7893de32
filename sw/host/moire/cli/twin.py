# SPDX-License-Identifier: Apache-2.0
"""The port `twin`: a simulated machine instead of a serial port."""

from importlib.metadata import entry_points
from typing import Any

from moire.bus.transport import Transport
from moire.errors import TwinNotBuilt, UnknownName

PORT = "twin"  # --port twin; --port twin:s2 names the machine too
MACHINES = {  # made by experiments.machines
    "s0": "X-Y stage with a grating interferometer, one node per axis",
    "s0_fine": "X axis of the stage s0 with a piezo on its table",
    "s2": "three stepper axes with scales in one node",
    "s3": "linear motor with a scale and its reference mark",
    "s4": "indexing table and wire-EDM machine, node 1 with the panel, node 2 with the table",
}


def machine_of(port: str) -> str | None:
    """The machine that a port such as "twin" or "twin:s2" names; None for all other ports."""
    kind, _, name = port.partition(":")
    if kind != PORT:
        return None
    if name and name not in MACHINES:
        raise UnknownName(
            f"there is no simulated machine '{name}': known are {', '.join(MACHINES)}"
        )
    return name or "s0"


def make_twin(baud: int, machine: str = "s0", seed: int = 1, **settings: Any) -> Transport:
    """The transport of a simulated machine. A checkout of Moire provides it as the entry point
    `twin` of the group `moire.ports`; an installed package alone has none.
    """
    found = tuple(entry_points(group="moire.ports", name=PORT))
    if not found:
        raise TwinNotBuilt(
            "the simulated machine needs a checkout of Moire: run `make demo` there and "
            "use its build/venv/bin/moire"
        )
    transport: Transport = found[0].load()(machine, seed, **settings)
    transport.set_baud(baud)
    return transport

# SPDX-License-Identifier: Apache-2.0
"""A reset of thousands of flip-flops goes to them on a clock line of an ECP5.

nextpnr gives the lines of its clock network to clocks alone, unless a DCCA drives a net. A reset of
a node with eight axes takes the wires between the tiles then; router1 rips its branches up and
routes them again, for hours in place of minutes. Logic that reads the reset stays at the flip-flop
that makes it: a clock line ends at clock and reset inputs.
"""

import json
from collections import Counter
from pathlib import Path

from boards.circuit import TOP

LOADS = 4096  # flip-flops of a reset from which on this is worth a clock line
FLIP_FLOP, RESET = "TRELLIS_FF", "LSR"
BUFFER = "DCCA"


def put_on_clock_line(netlist: Path, loads: int = LOADS) -> None:
    """Changes a netlist of Yosys where a net resets at least so many flip-flops."""
    design = json.loads(netlist.read_text(encoding="utf-8"))
    top = design["modules"][TOP]
    reset = [
        cell["connections"][RESET]
        for cell in top["cells"].values()
        if cell["type"] == FLIP_FLOP and RESET in cell["connections"]
    ]
    counts = Counter(net for (net,) in reset if isinstance(net, int))
    large = [net for net, flip_flops in counts.items() if flip_flops >= loads]
    if not large:
        return
    nets = {net for known in top["netnames"].values() for net in known["bits"]}
    first_free = 1 + max(net for net in nets if isinstance(net, int))
    for line, net in enumerate(large, first_free):
        for pin in reset:
            if pin == [net]:
                pin[:] = [line]
        name = f"global_reset_{line}"
        top["cells"][name] = {
            "hide_name": 0,
            "type": BUFFER,
            "parameters": {},
            "attributes": {},
            "port_directions": {"CLKI": "input", "CE": "input", "CLKO": "output"},
            "connections": {"CLKI": [net], "CE": ["1"], "CLKO": [line]},
        }
        top["netnames"][name] = {"hide_name": 0, "bits": [line], "attributes": {}}
    netlist.write_text(json.dumps(design), encoding="utf-8")

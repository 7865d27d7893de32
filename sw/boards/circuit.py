# SPDX-License-Identifier: Apache-2.0
"""The hash of a circuit, whatever its cells and nets are called and in which order they stand.

A line more in a source file gives other names to what Yosys makes of it, and another order; the
circuit is the same. Each cell gets a colour of its type, its parameters and its attributes, and
again and again one of those of its neighbours, until no further cells can be told apart (the
refinement of Weisfeiler and Leman). The hash is that of all colours.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

TOP = "top"  # the module of a netlist that nextpnr places
SCOPE = "$scopeinfo"  # a cell of Yosys that is no hardware
NAMES = ("src", "hdlname")  # ends of attributes that say where a cell comes from


def digest(words: Iterable[str]) -> str:
    return hashlib.blake2b(" ".join(words).encode(), digest_size=16).hexdigest()


def kind(cell: Mapping[str, Any]) -> str:
    """The first colour of a cell: all that it is, but for its name and its nets."""
    known = [(key, value) for key, value in cell["attributes"].items() if not key.endswith(NAMES)]
    return digest([cell["type"], repr(sorted(cell["parameters"].items())), repr(sorted(known))])


def pins_of(connections: Mapping[str, list[int | str]]) -> list[tuple[str, int | str]]:
    """(port and bit, net or constant) of each pin of a cell, or of each pad."""
    ports = sorted(connections.items())
    return [(f"{port}[{bit}]", net) for port, nets in ports for bit, net in enumerate(nets)]


def circuit_hash(netlist: Path) -> str:
    """The hash of the top module of a netlist that Yosys wrote as JSON."""
    top = json.loads(netlist.read_text(encoding="utf-8"))["modules"][TOP]
    cells = [cell for cell in top["cells"].values() if cell["type"] != SCOPE]
    colours = [kind(cell) for cell in cells]
    pins = [pins_of(cell["connections"]) for cell in cells]
    pads = pins_of(
        {f"{port['direction']} {name}": port["bits"] for name, port in top["ports"].items()}
    )

    ends: dict[int | str, list[tuple[int, str]]] = defaultdict(list)  # of a net: cells and pins
    fixed: dict[int | str, list[str]] = defaultdict(list)  # of a net: its pads
    for cell, pins_of_cell in enumerate(pins):
        for pin, net in pins_of_cell:
            ends[net].append((cell, pin))
    for pad, net in pads:
        fixed[net].append(pad)

    nets: dict[int | str, str] = {}  # colours; of a constant the constant
    told_apart = -1
    while told_apart < (now := len(set(colours))):
        told_apart = now
        for net in {*ends, *fixed}:
            joined = [*fixed[net], *(colours[cell] + pin for cell, pin in ends[net])]
            nets[net] = net if isinstance(net, str) else digest(sorted(joined))
        colours = [
            digest([colour, *(pin + nets[net] for pin, net in pins_of_cell)])
            for colour, pins_of_cell in zip(colours, pins)
        ]
    return digest([*sorted(colours), *(pad + nets[net] for pad, net in pads)])

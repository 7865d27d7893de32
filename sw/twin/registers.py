# SPDX-License-Identifier: Apache-2.0
"""The flip-flops and memories of a Verilated node, as a table in C++, so that the twin can flip a
bit of each.

A signal is a register if a rising edge changes it and the next one, or a pin, uses it, and if it is
not logic of other signals of its cycle. Verilator keeps it as a member of the class of all signals;
sw/twin/nodes/registers.h has the type of the table.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from twin.rising_edge import ROOT, Design, logic_first
from twin.statements import FormError, array, effect_of

MEMORY = re.compile(r"^VlUnpacked<(?:VlWide<\d+>|\w+)/\*(\d+):0\*/, (\d+)> (\w+);$", re.M)
OUTPUT = re.compile(r"VL_OUT\w*\(&?(\w+),(\d+),0")
WIDTH = re.compile(r"/\*(\d+):0\*/")
HELPER = re.compile(r"__V(?!cell)")  # variables that Verilator adds are no state of the design


def table(folder: Path, design: Design) -> Iterator[tuple[str, int, int]]:
    """(name, bits, words) of each register and memory of the design in this folder; a register has
    one word.
    """
    header = (folder / f"{ROOT}.h").read_text()
    memories = {name: (int(top) + 1, int(words)) for top, words, name in MEMORY.findall(header)}
    outputs = {name: int(top) + 1 for name, top in OUTPUT.findall(header)}
    logic, flip_flops = logic_first(design)
    whole = effect_of([*logic, *flip_flops])
    lasting = {array(name) for name in whole.needs} | design.outputs
    changed = {array(name) for name in whole.changes}
    combinational = {array(name) for name in design.logic} | set(design.locals)
    for name in sorted((changed & lasting) - combinational):
        if name in memories:
            yield name, *memories[name]
        elif name in outputs:
            yield name, outputs[name], 1
        elif not HELPER.search(name):
            match = WIDTH.search(design.types.get(name, ""))
            if not match:
                raise FormError(f"the width of {name} is not known")
            yield name, int(match[1]) + 1, 1


def header(folder: Path, design: Design) -> str:
    """C++ of the table."""
    lines = [
        f'{{"{name}", {bits}, {words}, offsetof({ROOT}, {name}), '
        f"sizeof({ROOT}::{name}) / {words}}},"
        for name, bits, words in table(folder, design)
    ]
    return "\n".join(
        ['#include "nodes/registers.h"', "const std::vector<twin::Register> REGISTERS = {"]
        + lines
        + ["};\n"]
    )

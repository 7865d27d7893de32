# SPDX-License-Identifier: Apache-2.0
"""Figure of the motion engine: how many cycles a servo tick needs at most."""

from figures.common import Figure, Quick
from tables.microcode.assembler import assembled
from tables.microcode.timing import worst


def engine_tick_cycles(axes: int = 8) -> float:
    between, axis = worst(assembled(), filters=0)
    return between + axes * axis


FIGURES = {
    "engine_tick_cycles": Figure(
        engine_tick_cycles,
        "cycles",
        "cycles of the motion engine for a servo tick of 8 axes without filters, the longest path "
        "through its microcode",
        "<= 3000",
        Quick(),
        0,
    ),
}

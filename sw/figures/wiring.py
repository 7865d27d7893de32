# SPDX-License-Identifier: Apache-2.0
"""Figure of the wiring: could a connection of a block diagram be cut, inverted or swapped without a
test that fails. The campaign over all connections is `make soak K=wiring`.
"""

from figures.common import Figure, Quick, console
from mutation import wiring
from mutation.connections import diagrams

QUICK_S = 30  # after which no further mutant is begun


def wiring_survivors(changed_only: bool = False, seconds: float = float("inf")) -> float:
    if changed_only:
        new = wiring.changed()
        verdicts = wiring.run(
            [file for file in diagrams() if any(c.file == file for c in new)],
            lambda connection: connection in new,
            seconds=seconds,
        )
    else:
        verdicts = wiring.run(diagrams(), seconds=seconds)
    console.print(f"wiring: {verdicts.words}")
    for line in verdicts.stale:
        console.print(f"  {line}")
    return float(verdicts.failures)


def soak() -> tuple[float, bool]:
    failures = wiring_survivors()
    return failures, failures == 0


FIGURES = {
    "wiring_survivors": Figure(
        wiring_survivors,
        "faults",
        "each port connection of the block diagrams tied to 0, tied to 1, inverted, and swapped "
        "with its neighbour: those that no test of the wiring sees and that have no reason in "
        "sw/mutation/wiring.toml",
        "0",
        Quick(
            {"changed_only": True, "seconds": QUICK_S},
            "the connections that differ from main, as many as 30 s allow",
        ),
        0,
    ),
}

SOAK = {"wiring": soak}

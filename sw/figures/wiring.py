# SPDX-License-Identifier: Apache-2.0
"""Figure of the wiring: could a connection of a block diagram be cut, inverted or swapped without a
test that fails. The campaign over all connections is `make soak K=wiring`.
"""

from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, console
from mutation import wiring
from mutation.connections import diagrams, of_diagram

QUICK_S = 30  # after which no further mutant is begun
PARTS = 200  # of the campaign, each with some of the instances


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


@cache
def instances() -> list[tuple[Path, str]]:
    """The instances of all diagrams, with their files."""
    return [
        (file, name)
        for file in diagrams()
        for name in sorted({connection.instance for connection in of_diagram(file)})
    ]


def verdicts_of(file: Path, instance: str) -> wiring.Verdicts:
    return wiring.run([file], lambda connection: connection.instance == instance)


def faults_of_part(part: int, seed: int) -> Counts:
    """The faults are the same for every seed: the tests draw numbers of their own."""
    counts = {"faults": 0, "survivors": 0, "explained": 0}
    for file, instance in instances()[part::PARTS]:
        verdicts = verdicts_of(file, instance)
        counts["faults"] += len(verdicts.killed) + len(verdicts.explained) + verdicts.failures
        counts["survivors"] += verdicts.failures
        counts["explained"] += len(verdicts.explained)
    return counts


CAMPAIGNS = {
    "wiring": Campaign(
        "faults in the wires of the block diagrams; failed: no test sees them, or one does that "
        "have a reason",
        faults_of_part,
        parts=PARTS,
        tried="faults",
        failed="survivors",
    )
}

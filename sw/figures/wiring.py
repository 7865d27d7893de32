# SPDX-License-Identifier: Apache-2.0
"""Figure of the wiring: could a connection of a block diagram be cut, inverted or swapped without a
test that fails. The campaign over all connections is `make soak K=wiring`.
"""

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, bar, console
from mutation import wiring, wiring_record
from mutation.connections import diagrams

QUICK_S = 30  # after which no further mutant is begun
PARTS = 200  # of the campaign, each with some of the instances


def changed_only(seconds: float) -> float:
    """Faults of the connections that differ from main, as many as can run in so many seconds."""
    new = wiring.changed()
    verdicts = wiring.run(
        [file for file in diagrams() if any(c.file == file for c in new)],
        lambda connection: connection in new,
        seconds=seconds,
    )
    console.print(f"wiring: {verdicts.words}")
    for line in verdicts.stale:
        console.print(f"  {line}")
    return float(verdicts.failures)


def wiring_survivors(seconds: float | None = None) -> float:
    if seconds is not None:
        return changed_only(seconds)
    with bar("instances") as progress:
        task = progress.add_task("", total=len(wiring_record.due()))
        for _, verdicts in wiring_record.recorded(diagrams()):
            progress.advance(task)
            for line in verdicts.stale:
                console.print(f"  {line}")
    console.print(wiring_record.summary())
    survivors = wiring_record.survivors()
    stale = wiring_record.due() - set(survivors)
    return float(sum(map(len, survivors.values())) + len(stale))


FIGURES = {
    "wiring_survivors": Figure(
        wiring_survivors,
        "faults",
        "each port connection of the block diagrams tied to 0, tied to 1, inverted, and swapped "
        "with its neighbour: those that no test of the wiring sees and that have no reason in "
        "sw/mutation/wiring.toml; a fault that was found does not run again as long as the "
        "connections of its instance are as they were",
        "0",
        Quick(
            {"seconds": QUICK_S},
            "the connections that differ from main, as many as 30 s allow",
        ),
        0,
    ),
}


def verdicts_of(place: wiring.Place) -> wiring.Verdicts:
    return wiring.run([place[0]], lambda connection: wiring.place_of(connection) == place)


def faults_of_part(part: int, seed: int) -> Counts:
    """The faults are the same for every seed: the tests draw numbers of their own."""
    counts = {"faults": 0, "survivors": 0, "explained": 0}
    for place in sorted(wiring_record.instances())[part::PARTS]:
        verdicts = verdicts_of(place)
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

# SPDX-License-Identifier: Apache-2.0
"""Figure of the mutation of the host: how many faults inside its modules their tests see."""

from figures.common import Absent, Figure, Quick, console
from mutation import host

FEW = 10  # mutants of a small module
SMALL = "moire.bus.cobs"


def verdicts_of(name: str, count: int, seed: int) -> host.Verdicts:
    """The verdicts of a module."""
    try:
        return host.measured(name, count, seed)
    except host.NotInstalled as error:
        raise Absent(str(error)) from error


def host_mutants_killed_pct(
    modules: tuple[str, ...] = (), count: int = host.MUTANTS, seed: int = 1
) -> float:
    """Of these modules, or of all that have tests in host.toml."""
    killed = tried = 0
    for name in modules or sorted(host.tests()):
        verdicts = verdicts_of(name, count, seed)
        console.print(f"{name}: {verdicts.words}")
        for mutant in verdicts.survivors:
            console.print(f"  {mutant.words}", markup=False, highlight=False)
        killed += verdicts.killed
        tried += verdicts.tried
    return 100 * killed / tried


FIGURES = {
    "host_mutants_killed_pct": Figure(
        host_mutants_killed_pct,
        "%",
        f"of {host.MUTANTS} mutants of each module in sw/mutation/host.toml (frames, packets, "
        "units, segments, ellipse, harmonics, spectrum) that its tests see; a mutant without a "
        "consequence counts as one that they do not see",
        ">= 90",
        Quick({"modules": (SMALL,), "count": FEW}, f"{FEW} mutants of {SMALL}", ""),
        1,
    ),
}

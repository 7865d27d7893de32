# SPDX-License-Identifier: Apache-2.0
"""Figures of the mutation of host and firmware: how many faults inside their sources tests see."""

from functools import partial

from figures.common import Absent, Figure, Quick, console
from mutation.firmware import C
from mutation.host import PYTHON
from mutation.sources import MUTANTS, Language, NotInstalled

FEW = 10  # mutants of a small source
OF_FIRMWARE = 25  # mutants of each source of the firmware, which has six times as many sources


def killed_pct(
    language: Language, count: int, sources: tuple[str, ...] = (), seed: int = 1
) -> float:
    """Of these sources, or of all that have tests in the table of the language."""
    killed = tried = 0
    for name in sources or sorted(language.tests()):
        try:
            verdicts = language.measured(name, count, seed)
        except NotInstalled as error:
            raise Absent(str(error)) from error
        console.print(f"{name}: {verdicts.words}")
        for mutant in verdicts.survivors:
            console.print(f"  {mutant.words}", markup=False, highlight=False)
        killed += verdicts.killed
        tried += verdicts.tried
    return 100 * killed / tried


def figure(language: Language, count: int, small: str, words: str, bound: str) -> Figure:
    """The share of a language, and the short form with a small source."""
    return Figure(
        partial(killed_pct, language, count=count),
        "%",
        f"of {count} mutants of each {words}",
        bound,
        Quick({"sources": (small,), "count": FEW}, f"{FEW} mutants of {small}", ""),
        1,
    )


FIGURES = {
    "host_mutants_killed_pct": figure(
        PYTHON,
        MUTANTS,
        "moire.bus.cobs",
        "module in sw/mutation/host.toml (frames, packets, units, segments, ellipse, harmonics, "
        "spectrum) that its tests see; a mutant without a consequence counts as one that they do "
        "not see",
        ">= 90",
    ),
    "firmware_mutants_killed_pct": figure(
        C,
        OF_FIRMWARE,
        "core/crc32.c",
        "source of the firmware in sw/mutation/firmware.toml that its tests see, of those of which "
        "the compiler makes other code than of the source",
        ">= 90",
    ),
}

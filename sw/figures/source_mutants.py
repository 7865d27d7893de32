# SPDX-License-Identifier: Apache-2.0
"""Figures of the mutation of host and firmware: how many faults inside their sources tests see."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from figures.common import Absent, Figure, Quick
from figures.mutants import found_pct
from mutation.firmware import C
from mutation.host import PYTHON
from mutation.sources import MUTANTS, Language, NotInstalled

FEW = 10  # mutants of a small source
OF_FIRMWARE = 25  # mutants of each source of the firmware, which has six times as many sources


def entries(
    language: Language, count: int, small: str | None, seed: int
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Each source with its entry of docs/mutants.toml, or a small one, which is not added there."""
    subjects = language.subjects
    if small:
        verdicts = language.measured(small, count, seed)
        yield small, subjects.entry(small, verdicts, count, seed)
    else:
        yield from subjects.recorded(sorted(subjects.names()), count, seed)


def killed_pct(language: Language, count: int, small: str | None = None, seed: int = 1) -> float:
    try:
        return found_pct(entries(language, count, small, seed))
    except NotInstalled as error:
        raise Absent(str(error)) from error


def figure(language: Language, count: int, small: str, words: str, bound: str) -> Figure:
    """The share of a language, and the short form with a small source."""
    return Figure(
        partial(killed_pct, language, count=count),
        "%",
        f"of {count} mutants of each {words}; a source that has not changed since is not run again",
        bound,
        Quick({"small": small, "count": FEW}, f"{FEW} mutants of {small}", ""),
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

# SPDX-License-Identifier: Apache-2.0
"""Figures of the mutation of blocks: how many faults inside a block the tests of the block see. The
campaign over all blocks is `make soak K=mutants`.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, console
from figures.synthesis import SynthesisError
from mutation import blocks
from mutation.block import MutationError
from mutation.command import ENOUGH, different, words_of
from twin.build import ROOT

TINY, FEW = "step_permission", 20  # a small block, and some of its mutants
WEAK, FEWER = "latency_is_0", 4  # a test of it that does not see all of these


@cache
def names() -> tuple[str, ...]:
    """The blocks, the smallest first."""
    sizes = {path.stem: path.stat().st_size for path in Path(ROOT / "rtl").rglob("*.sv")}
    return tuple(sorted(blocks.tests(), key=lambda name: sizes[name]))


@cache
def verdicts_of(name: str, count: int, seed: int, only: str = "") -> blocks.Verdicts:
    """The verdicts of a block."""
    try:
        return blocks.measured(name, count, seed, only)
    except MutationError as error:
        raise SynthesisError(str(error)) from error


def entries(tiny: bool, seed: int) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Each block with its entry of docs/mutants.toml, or a tiny one, which is not added there."""
    if not tiny:
        try:
            yield from blocks.BLOCKS.recorded(names(), blocks.MUTANTS, seed)
        except MutationError as error:
            raise SynthesisError(str(error)) from error
        return
    planted = verdicts_of(TINY, FEWER, seed, WEAK)
    if not any(survivor.mutant.text for survivor in planted.survivors):
        raise SynthesisError(
            f"{TINY} has no survivors with one of its tests alone: {planted.words}"
        )
    yield TINY, blocks.BLOCKS.entry(TINY, verdicts_of(TINY, FEW, seed), FEW, seed)


def found_pct(measured: Iterable[tuple[str, Mapping[str, Any]]]) -> float:
    """Percent of the mutants of these entries that tests have found; each entry is printed."""
    found = of = 0
    for name, entry in measured:
        console.print(words_of(name, entry), markup=False, highlight=False)
        found += entry["found"]
        of += different(entry)
    return 100 * found / of


def mutants_killed_pct(tiny: bool = False, seed: int = 1) -> float:
    return found_pct(entries(tiny, seed))


def mutants_blocks_under_95(tiny: bool = False, seed: int = 1) -> float:
    under = [n for n, e in entries(tiny, seed) if 100 * e["found"] < ENOUGH * different(e)]
    console.print(f"under {ENOUGH} %: {', '.join(under) or 'none'}")
    return float(len(under))


SHORT = Quick(
    {"tiny": True},
    f"{FEW} mutants of {TINY}; with one test of it alone, survivors must be reported",
)
FIGURES = {
    "mutants_killed_pct": Figure(
        mutants_killed_pct,
        "%",
        "of 1 000 mutants of each block that its tests see, of those that are not proved to be "
        "equivalent; a mutant with a reason is one that they do not see, and a block whose source "
        "has not changed since is not run again",
        ">= 97",
        SHORT,
        1,
    ),
    "mutants_blocks_under_95": Figure(
        mutants_blocks_under_95,
        "blocks",
        "whose tests see fewer than 95 % of their mutants that are not proved to be equivalent",
        "0",
        SHORT,
        0,
    ),
}


def mutants_of_part(part: int, seed: int) -> Counts:
    """One block."""
    name = names()[part]
    verdicts = verdicts_of(name, blocks.MUTANTS, seed)
    counts: dict[str, float | str] = {
        "mutants": verdicts.different + verdicts.equivalent,
        "found": verdicts.killed,
        "equivalent": verdicts.equivalent,
        "explained": len(verdicts.explained),
        "survivors": len(verdicts.survivors),
        "blocks under 95 %": int(verdicts.percent < ENOUGH),
    }
    for number, survivor in enumerate(verdicts.survivors):
        counts[f"survivor {number}"] = survivor.text
    return counts


CAMPAIGNS = {
    "mutants": Campaign(
        "faults inside the blocks, 1 000 of each; failed: survivors that no test of the block sees "
        "and that have no reason",
        mutants_of_part,
        parts=len(names()),
        tried="mutants",
        failed="survivors",
    )
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of the mutation of blocks: how many faults inside a block the tests of the block see. The
campaign over all blocks is `make soak K=mutants`.
"""

from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, console
from figures.synthesis import SynthesisError
from mutation import blocks
from mutation.block import MutationError
from mutation.command import ENOUGH
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


def verdicts_of_all(tiny: bool, seed: int) -> dict[str, blocks.Verdicts]:
    """Those of all blocks, or of a tiny one."""
    if not tiny:
        return {name: verdicts_of(name, blocks.MUTANTS, seed) for name in names()}
    planted = verdicts_of(TINY, FEWER, seed, WEAK)
    if not any(survivor.mutant.text for survivor in planted.survivors):
        raise SynthesisError(
            f"{TINY} has no survivors with one of its tests alone: {planted.words}"
        )
    return {TINY: verdicts_of(TINY, FEW, seed)}


def mutants_killed_pct(tiny: bool = False, seed: int = 1) -> float:
    killed = different = 0
    for name, verdicts in verdicts_of_all(tiny, seed).items():
        console.print(f"{name}: {verdicts.words}")
        for survivor in verdicts.survivors:
            console.print(f"  {survivor.text}", markup=False, highlight=False)
        killed += verdicts.killed
        different += verdicts.different
    return 100 * killed / different


def mutants_blocks_under_95(tiny: bool = False, seed: int = 1) -> float:
    found = verdicts_of_all(tiny, seed)
    under = [name for name, verdicts in found.items() if verdicts.percent < ENOUGH]
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
        "equivalent; a mutant with a reason is one that they do not see",
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

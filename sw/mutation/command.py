# SPDX-License-Identifier: Apache-2.0
"""The command line of a mutation test of blocks or modules, one after the other."""

import argparse
import sys
from collections.abc import Callable, Collection, Sequence
from typing import Protocol, TypeVar

from campaigns import record
from mutation.block import MutationError


class Verdicts(Protocol):
    """What became of the mutants of one block or module."""

    stale: list[str]

    @property
    def words(self) -> str:
        """The numbers, in one line."""


V = TypeVar("V", bound=Verdicts)
ENOUGH = 95  # percent of the mutants of a block


def summary(known: Collection[str]) -> str:
    """What docs/mutants.toml has of blocks or modules: their numbers together, those of which the
    tests see too few, and those of which none have been run.
    """
    entries = {n: e for n, e in record.read(record.MUTANTS).items() if n in known}
    different = {name: entry["mutants"] - entry["equivalent"] for name, entry in entries.items()}
    found, of = sum(entry["found"] for entry in entries.values()), sum(different.values())
    survivors = sum(len(entry["survivors"]) for entry in entries.values())
    explained = sum(len(entry["explained"]) for entry in entries.values())
    under = [n for n, e in entries.items() if 100 * e["found"] < ENOUGH * different[n]]
    missing = sorted(set(known) - set(entries))
    return "\n".join(
        (
            f"{len(entries)} of {len(known)} have been run: {found} of {of} mutants found "
            f"({100 * found / max(of, 1):.1f} %), {explained} with a reason, {survivors} survivors",
            f"under {ENOUGH} %: {', '.join(under) or 'none'}",
            f"not run: {', '.join(missing) or 'none'}",
        )
    )


def run(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    known: Collection[str],
    unknown: str,  # what is said of another name
    mutants: int,  # of each, unless the command line says it
    measured: Callable[[str, int, int], V],
    entry_of: Callable[[V, int, int], record.Entry],
) -> int:
    """Measure those that the first argument of the parser names, or all that are known; the exit
    code is 1 if anything survives, a reason is stale, or one cannot be measured.
    """
    parser.add_argument("--list", action="store_true", help="print the names, run nothing")
    parser.add_argument(
        "--summary", action="store_true", help="print what docs/mutants.toml has, run nothing"
    )
    parser.add_argument("--count", type=int, default=mutants, help="mutants of each")
    parser.add_argument("--seed", type=int, default=1, help="which mutants, 1 and up")
    parser.add_argument("--record", action="store_true", help="add the results to docs")
    options = parser.parse_args(arguments)
    names = options.names or sorted(known)
    if others := set(names) - set(known):
        parser.error(f"{sorted(others)[0]} {unknown}")
    if options.list:
        print(*names, sep="\n")
        return 0
    if options.summary:
        print(summary(names))
        return 0
    wrong = 0
    for name in names:
        try:
            verdicts = measured(name, options.count, options.seed)
        except MutationError as error:
            print(error, file=sys.stderr, flush=True)
            wrong += 1
            continue
        entry = entry_of(verdicts, options.count, options.seed)
        survivors = entry["survivors"]
        assert isinstance(survivors, list)
        print(f"{name}: {verdicts.words}", flush=True)
        for survivor in survivors:
            print(f"  {survivor}", flush=True)
        for line in verdicts.stale:
            print(f"  stale reason: {line}", flush=True)
        wrong += len(survivors) + len(verdicts.stale)
        if options.record:
            record.add(name, entry)
    return int(wrong > 0)

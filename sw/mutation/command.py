# SPDX-License-Identifier: Apache-2.0
"""The command line of a mutation test of blocks or modules, one after the other."""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeVar

from mutation import record
from mutation.block import MutationError


class Verdicts(Protocol):
    """What became of the mutants of one block or module."""

    stale: list[str]

    @property
    def words(self) -> str:
        """The numbers, in one line."""


V = TypeVar("V", bound=Verdicts)


def run(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    known: Iterable[str],
    unknown: str,  # what is said of another name
    mutants: int,  # of each, unless the command line says it
    measured: Callable[[str, int, int], V],
    entry_of: Callable[[V, int, int], record.Entry],
) -> int:
    """Measure those that the first argument of the parser names, or all that are known; the exit
    code is 1 if anything survives, a reason is stale, or one cannot be measured.
    """
    parser.add_argument("--list", action="store_true", help="print the names, run nothing")
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

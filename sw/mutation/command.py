# SPDX-License-Identifier: Apache-2.0
"""Mutation tests of blocks or sources, one after the other: their record and their command line."""

import argparse
import hashlib
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

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
    of = sum(map(different, entries.values()))
    found = sum(entry["found"] for entry in entries.values())
    survivors = sum(len(entry["survivors"]) for entry in entries.values())
    explained = sum(len(entry["explained"]) for entry in entries.values())
    under = [n for n, e in entries.items() if 100 * e["found"] < ENOUGH * different(e)]
    missing = sorted(set(known) - set(entries))
    return "\n".join(
        (
            f"{len(entries)} of {len(known)} have been run: {found} of {of} mutants found "
            f"({100 * found / max(of, 1):.1f} %), {explained} with a reason, {survivors} survivors",
            f"under {ENOUGH} %: {', '.join(under) or 'none'}",
            f"not run: {', '.join(missing) or 'none'}",
        )
    )


@dataclass(frozen=True)
class Subjects(Generic[V]):
    """The blocks or sources of one kind, and how their mutants are run."""

    names: Callable[[], Collection[str]]
    unknown: str  # what is said of another name
    path_of: Callable[[str], Path]
    # of a name, so many mutants, by a seed; of these the survivors of an entry, if there are any
    measured: Callable[[str, int, int, Sequence[str]], V]
    entry_of: Callable[[V, int, int], record.Entry]

    def source(self, name: str) -> str:
        """A hash of the source."""
        return hashlib.sha256(self.path_of(name).read_bytes()).hexdigest()[:12]

    def entry(self, name: str, verdicts: V, count: int, seed: int) -> dict[str, Any]:
        """What the record says of these verdicts."""
        return {"source": self.source(name), **self.entry_of(verdicts, count, seed)}

    def known(self, name: str, count: int) -> dict[str, Any] | None:
        """The entry of the record that has so many mutants of the source as it is, if there is one.
        They are those of the first seed.
        """
        entry = record.read(record.MUTANTS).get(name)
        if not entry or entry["asked"] < count or entry["seed"] != 1:
            return None
        return entry if entry.get("source") == self.source(name) else None

    def recorded(
        self, names: Iterable[str], count: int, seed: int = 1
    ) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Each name with its entry. What the record does not have is run and added to it, so that
        an interrupted run can go on; but with another seed all are run and nothing is added.
        """
        for name in names:
            entry = self.known(name, count) if seed == 1 else None
            if entry is None:
                entry = self.entry(name, self.measured(name, count, seed, ()), count, seed)
                if seed == 1:
                    record.add(name, entry, record.MUTANTS)
            yield name, entry

    def again(self, name: str) -> dict[str, Any]:
        """The entry of the record after another run of its survivors, with the tests and reasons as
        they are now.
        """
        old = self.known(name, 0)
        if old is None:
            raise MutationError(f"{name}: the record has no mutants of the source as it is")
        survivors = old["survivors"]
        if not survivors:
            return old
        verdicts = self.measured(name, old["asked"], old["seed"], survivors)
        new = self.entry(name, verdicts, old["asked"], old["seed"])
        if new["mutants"] != len(survivors):
            raise MutationError(
                f"{name}: {new['mutants']} mutants have the names of {len(survivors)} survivors: "
                "run all mutants"
            )
        sums = {key: old[key] + new[key] for key in ("found", "equivalent", "explained")}
        return {**old, **sums, "survivors": new["survivors"]}


def different(entry: Mapping[str, Any]) -> int:
    """The mutants of an entry that are not proved to be equivalent."""
    return int(entry["mutants"] - entry["equivalent"])


def words_of(name: str, entry: Mapping[str, Any], numbers: str = "") -> str:
    """An entry in some lines: its numbers, or these, and the survivors."""
    numbers = numbers or f"{entry['found']} of {different(entry)} found"
    return "\n  ".join([f"{name}: {numbers}", *entry["survivors"]])


def run(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    subjects: Subjects[V],
    mutants: int,  # of each, unless the command line says it
) -> int:
    """Run the mutants of those that the first argument of the parser names, or of all; the exit
    code is 1 if anything survives, a reason is stale, or one cannot be measured.
    """
    known = subjects.names()
    parser.add_argument("--list", action="store_true", help="print the names, run nothing")
    parser.add_argument(
        "--summary", action="store_true", help="print what docs/mutants.toml has, run nothing"
    )
    parser.add_argument("--count", type=int, default=mutants, help="mutants of each")
    parser.add_argument("--seed", type=int, default=1, help="which mutants, 1 and up")
    parser.add_argument(
        "--again",
        action="store_true",
        help="run only the survivors of docs/mutants.toml, with its count and seed",
    )
    parser.add_argument("--record", action="store_true", help="add the results to docs")
    options = parser.parse_args(arguments)
    names = options.names or sorted(known)
    if others := set(names) - set(known):
        parser.error(f"{sorted(others)[0]} {subjects.unknown}")
    if options.list:
        print(*names, sep="\n")
        return 0
    if options.summary:
        print(summary(names))
        return 0
    wrong = 0
    for name in names:
        stale: Sequence[str] = ()
        try:
            if options.again:
                entry = subjects.again(name)
                print(words_of(name, entry), flush=True)
            else:
                verdicts = subjects.measured(name, options.count, options.seed, ())
                entry = subjects.entry(name, verdicts, options.count, options.seed)
                stale = verdicts.stale
                print(words_of(name, entry, verdicts.words), flush=True)
        except MutationError as error:
            print(error, file=sys.stderr, flush=True)
            wrong += 1
            continue
        for line in stale:
            print(f"  stale reason: {line}", flush=True)
        wrong += len(entry["survivors"]) + len(stale)
        if options.record:
            record.add(name, entry, record.MUTANTS)
    return int(wrong > 0)

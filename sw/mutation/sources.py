# SPDX-License-Identifier: Apache-2.0
"""Mutants of sources of a programming language: what the tests of a source see of its faults.

A mutant is a text of the source with one fault. A table (TOML) has the tests of each source, and
reasons for mutants that no test can find. mutation.forked_tests runs the tests for each text.
"""

import argparse
import fnmatch
import json
import os
import random
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from campaigns import record
from mutation import command
from mutation.block import BUILD, MutationError
from twin.build import ROOT

MUTANTS = 100  # of a source
MUTATORS = ROOT / "build" / "mutators"
INSTALL = "make mutators"
PATIENCE, LEAST_S = 3, 5  # a run has no end if it takes so many times as without a mutant, and 5 s
UNLIMITED_S = 3600

Place = TypeVar("Place", int, tuple[int, int])  # in a source
Fault = TypeVar("Fault")


class NotInstalled(MutationError):
    """The package that makes the mutants is not there."""


@dataclass(frozen=True)
class SourceMutant:
    """One fault in a source."""

    path: Path
    line: int
    old: str  # the line of the source without its indentation
    new: str  # the same line of the mutant, or an empty text if it is gone
    text: str  # of the whole mutant

    @property
    def words(self) -> str:
        """One line for a person."""
        path = self.path.relative_to(ROOT)
        return f"{path}:{self.line}: {self.old} -> {self.new or '(nothing)'}"


@dataclass(frozen=True)
class Reason:
    """Why no test can find some mutants of a line."""

    source: str
    line: str  # of the source, without its indentation
    mutant: str  # pattern of the line of the mutant
    why: str

    def explains(self, mutant: SourceMutant) -> bool:
        """Whether it is about this mutant of its source."""
        return self.line == mutant.old and fnmatch.fnmatchcase(mutant.new, self.mutant)


@dataclass
class Verdicts:
    """What became of the mutants of a source."""

    killed: int = 0
    equivalent: int = 0  # proved; they do not count
    survivors: list[SourceMutant] = field(default_factory=list)  # without a reason
    explained: list[tuple[SourceMutant, Reason]] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)  # reasons whose mutants are all found

    @property
    def tried(self) -> int:
        """All mutants that count."""
        return self.killed + len(self.survivors) + len(self.explained)

    @property
    def words(self) -> str:
        """The numbers, in one line."""
        equivalent = f"{self.equivalent} equivalent, " if self.equivalent else ""
        return (
            f"{self.killed} of {self.tried} found, {equivalent}{len(self.survivors)} survivors, "
            f"{len(self.explained)} explained, {len(self.stale)} stale reasons"
        )


def never(_mutant: SourceMutant) -> bool:
    """Of a language in which nothing proves that a mutant is equivalent to its source."""
    return False


@dataclass(frozen=True)
class Language:
    """How the sources of one language are mutated and tested."""

    name: str  # as mutation.forked_tests knows it
    table: Path
    package: str  # that makes the mutants, in build/mutators
    maker: str  # program that prints texts of mutants as a list in JSON: FILE COUNT SEED
    path_of: Callable[[str], Path]  # of a source of the table
    equivalent: Callable[[SourceMutant], bool] = never  # whether a survivor is proved to be so

    def entries(self) -> Mapping[str, object]:
        """The table."""
        return tomllib.loads(self.table.read_text())

    def tests(self) -> dict[str, list[str]]:
        """{source: files of its tests}"""
        found = self.entries()["tests"]
        assert isinstance(found, dict)
        return found

    def reasons(self) -> list[Reason]:
        """The reasons of the table. MutationError names one whose line does not exist."""
        entries = self.entries().get("reason", [])
        assert isinstance(entries, list)
        found = [
            Reason(source, entry["line"], entry["mutant"], entry["why"])
            for entry in entries
            for source in entry["sources"]
        ]
        for reason in found:
            lines = self.path_of(reason.source).read_text().splitlines()
            if reason.line not in [line.strip() for line in lines]:
                raise MutationError(
                    f"{self.table.name}: {reason.source} has no line {reason.line!r}"
                )
        return found

    def mutants_of(self, source: str, count: int, seed: int) -> list[SourceMutant]:
        """So many mutants of a source, spread over its places; fewer if it has fewer."""
        if not (MUTATORS / self.package).exists():
            raise NotInstalled(f"{self.package} is not installed: {INSTALL}")
        path = self.path_of(source)
        made = subprocess.run(
            [sys.executable, "-m", self.maker, path, str(count), str(seed)],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, str(MUTATORS)])},
            capture_output=True,
            text=True,
        )
        if made.returncode:
            why = made.stderr.strip().rpartition("\n")[2]
            raise MutationError(f"{source}: no mutants are made: {why}")
        return [difference(path, text) for text in json.loads(made.stdout)]

    def runs(
        self, source: str, texts: Sequence[str], seed: int, longest_s: float
    ) -> Iterator[tuple[int, str, float]]:
        """(number of the text, the test that failed or "", computing time in s) of each text."""
        BUILD.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=BUILD, prefix=f"{self.name}-") as folder:
            request = Path(folder) / "request.json"
            asked = {
                "language": self.name,
                "folder": folder,
                "source": source,
                "path": str(self.path_of(source)),
                "tests": self.tests()[source],
                "texts": list(texts),
                "seed": seed,
                "longest_s": longest_s,
            }
            request.write_text(json.dumps(asked))
            running = subprocess.Popen(
                [sys.executable, "-m", "mutation.forked_tests", str(request)],
                cwd=ROOT,
                env={
                    **os.environ,
                    "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path]),
                    "OPENBLAS_NUM_THREADS": "1",
                    "HYPOTHESIS_STORAGE_DIRECTORY": folder,
                },
                stdout=subprocess.PIPE,
                text=True,
            )
            assert running.stdout
            for line in running.stdout:
                number, failed, seconds = json.loads(line)
                yield number, failed, seconds
            if running.wait():
                raise MutationError(f"{source}: the runs ended with exit code {running.returncode}")

    def measured(
        self, source: str, count: int = MUTANTS, seed: int = 1, survivors: Collection[str] = ()
    ) -> Verdicts:
        """Run the tests of a source on so many mutants of it: on all of them, or on the survivors
        whose words are given.
        """
        known = [reason for reason in self.reasons() if reason.source == source]
        mutants = [
            mutant
            for mutant in self.mutants_of(source, count, seed)
            if not survivors or mutant.words in survivors
        ]
        original = self.path_of(source).read_text()
        [(_, failed, seconds)] = self.runs(source, [original], seed, UNLIMITED_S)
        if failed:
            raise MutationError(f"{source}: without a mutant {failed} fails")
        verdicts, met = Verdicts(), dict[Reason, bool]()  # whether it is needed
        longest_s = PATIENCE * seconds + LEAST_S
        texts = [mutant.text for mutant in mutants]
        for number, failed, _ in self.runs(source, texts, seed, longest_s):
            mutant = mutants[number]
            reason = next((reason for reason in known if reason.explains(mutant)), None)
            if reason:
                met[reason] = met.get(reason, False) or not failed
            if failed:
                verdicts.killed += 1
            elif self.equivalent(mutant):
                verdicts.equivalent += 1
            elif reason:
                verdicts.explained.append((mutant, reason))
            else:
                verdicts.survivors.append(mutant)
        verdicts.stale = [
            f"{r.source}: {r.line}: {r.mutant}" for r, needed in met.items() if not needed
        ]
        return verdicts

    @property
    def subjects(self) -> command.Subjects[Verdicts]:
        """The sources, for the record and the command line."""
        unknown = f"has no tests in {self.table.relative_to(ROOT)}"
        return command.Subjects(self.tests, unknown, self.path_of, self.measured, entry_of)

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """The command line of a mutation test of such sources; returns its exit code."""
        parser = argparse.ArgumentParser(prog=f"python -m mutation.{self.name}")
        parser.add_argument(
            "names", nargs="*", metavar="SOURCE", help=f"of {self.table.name}; default: all"
        )
        return command.run(parser, arguments, self.subjects, MUTANTS)


def drawn(places: Mapping[Place, list[Fault]], draw: random.Random) -> Iterator[Fault]:
    """All faults in a random order: first one at each place, then further ones."""
    order = [places[place] for place in draw.sample(sorted(places), len(places))]
    for faults in order:
        draw.shuffle(faults)
    while order:
        faults = order.pop(0)
        yield faults.pop()
        if faults:
            order.append(faults)


def difference(path: Path, text: str) -> SourceMutant:
    """The mutant of the source at the path that this text is."""
    old, new = path.read_text().splitlines(), text.splitlines()
    at = next(n for n, (a, b) in enumerate(zip([*old, ""], [*new, ""])) if a != b)
    same_length = len(old) == len(new)
    return SourceMutant(path, at + 1, old[at].strip(), new[at].strip() if same_length else "", text)


def entry_of(verdicts: Verdicts, count: int, seed: int) -> record.Entry:
    """What docs/mutants.toml says of a source."""
    return {
        "mutants": verdicts.tried + verdicts.equivalent,
        "seed": seed,
        "asked": count,
        "found": verdicts.killed,
        "equivalent": verdicts.equivalent,
        "survivors": [mutant.words for mutant in verdicts.survivors],
        "explained": [f"{mutant.words}: {reason.why}" for mutant, reason in verdicts.explained],
    }

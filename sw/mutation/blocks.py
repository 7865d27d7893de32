# SPDX-License-Identifier: Apache-2.0
"""Which faults inside a block no test of the block sees.

python -m mutation.blocks [BLOCK …]     mutants of these blocks, or of all; see --help

The tests of a block run on its netlist with mutants (mutation.block), which are divided among the
builds with different parameters that its tests make. What no test sees and what is not equivalent
(mutation.equivalence) is a survivor. It needs a better test, or a reason in blocks.toml.
"""

import argparse
import fcntl
import fnmatch
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from campaigns import record
from mutation import command, equivalence
from mutation.block import (
    BUILD,
    CellMutant,
    Fault,
    MutationError,
    Run,
    build_words,
    label,
    mutants_of,
)
from twin.build import ROOT, rtl_path

MUTANTS = 1000  # of a block
LOOK = 30  # of a fault in another build
BEFORE_WORDS = "; "  # of equivalence, in the line of a survivor
REASONS = Path(__file__).with_name("blocks.toml")
LONGEST_S = 24 * 3600


@dataclass(frozen=True)
class Reason:
    """Why no test can find some survivors of a block."""

    block: str
    line: str  # of the source, without its indentation
    mutant: str  # pattern of their names
    why: str
    build: str = "*"  # pattern of the parameters


@dataclass(frozen=True)
class Survivor:
    """A mutant that no test of its block sees."""

    label: str  # its place and its name
    mutant: CellMutant
    words: str  # of equivalence

    @property
    def text(self) -> str:
        """One line for a person."""
        return f"{self.label}{BEFORE_WORDS}{self.words}"


def fits(reason: Reason, block: str, build: str, mutant: CellMutant) -> bool:
    """Whether a reason is about a mutant of a build."""
    return (
        reason.block == block
        and reason.line == mutant.text
        and fnmatch.fnmatchcase(mutant.name, reason.mutant)
        and fnmatch.fnmatchcase(build, reason.build)
    )


@cache
def reasons() -> tuple[Reason, ...]:
    """The table of reasons."""
    entries = tomllib.loads(REASONS.read_text()).get("reason", [])
    return tuple(Reason(**entry) for entry in entries)


@dataclass
class Verdicts:
    """What became of the mutants of a block."""

    killed: int = 0
    equivalent: int = 0
    undecided: int = 0  # of the survivors, those without a difference in the cycles of the search
    survivors: list[Survivor] = field(default_factory=list)  # without a reason
    explained: list[tuple[Survivor, Reason]] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)  # reasons whose mutants are all found

    @property
    def different(self) -> int:
        """Mutants that are not equivalent."""
        return self.killed + len(self.survivors) + len(self.explained)

    @property
    def percent(self) -> float:
        """Share of the mutants that are not equivalent which tests find."""
        return 100 * self.killed / self.different if self.different else 100.0

    @property
    def words(self) -> str:
        return (
            f"{self.killed} of {self.different} found, {self.equivalent} equivalent, "
            f"{len(self.survivors)} survivors ({self.undecided} undecided), "
            f"{len(self.explained)} explained, {len(self.stale)} stale reasons"
        )


@cache
def tests() -> dict[str, list[Path]]:
    """{block: files of the tests that simulate it by itself} of all blocks below rtl/."""
    known = {path.stem for path in (ROOT / "rtl").rglob("*.sv")}
    found: dict[str, list[Path]] = {}
    for file in sorted((ROOT / "tb").rglob("test_*.py")):
        named = re.findall(r"\brun\(\s*\"(\w+)\",\s*__file__", file.read_text())
        for name in sorted(set(named) & known):
            found.setdefault(name, []).append(file)
    return found


def pytest(
    arguments: Sequence[object], environment: dict[str, str], kept: Sequence[int] = ()
) -> str:
    """What pytest prints; an error if a test fails. It keeps the files `kept` open to its end."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            *map(str, arguments),
        ],
        cwd=ROOT,
        env={**os.environ, "SIM": "icarus", **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        pass_fds=kept,
    )
    if done.returncode:
        raise MutationError(f"pytest {arguments[-1]}: {(done.stdout + done.stderr)[-1500:]}")
    return done.stdout


@cache
def builds_of(block: str) -> int:
    """How many builds the tests of a block make, at most."""
    return pytest(["--collect-only", *tests()[block]], {}).count("::")


Results = dict[CellMutant, bool]  # whether a test finds it
Runs = Sequence[tuple[Run, dict[int, str]]]


def results_of(block: str, runs: Runs) -> dict[str, Results]:
    """{folder of a build: its results}. A mutant that one of several tests of the same build finds
    is found.
    """
    results: dict[str, Results] = {}
    for run, found in runs:
        if missing := set(run.numbers) - set(found):
            raise MutationError(f"{block}: {len(missing)} mutants were not run")
        known = {mutant.number: mutant for mutant in mutants_of(Path(run.folder))}
        build = results.setdefault(run.folder, {})
        for number, test in found.items():
            build[known[number]] = build.get(known[number], False) or bool(test)
    return results


def found_elsewhere(mutant: CellMutant, others: Sequence[Results]) -> bool:
    """Whether another build has mutants of other bits at this place, and tests find all of them."""
    for results in others:
        same = [found for other, found in results.items() if other.fault == mutant.fault]
        if same and all(same):
            return True
    return False


class Builds:
    """The results of all builds of a block: those of its own mutants, and those of runs that look
    for the faults that other builds have left.
    """

    def __init__(self, block: str, runs: Runs, looks: Runs = ()):
        self.results = results_of(block, runs)
        self.parameters = {run.folder: run.parameters for run, _ in [*runs, *looks]}
        self.known: dict[str, list[Results]] = {}  # words of the parameters
        for folder, results in [*self.results.items(), *results_of(block, looks).items()]:
            self.known.setdefault(build_words(self.parameters[folder]), []).append(results)

    def seen(self, folder: str, mutant: CellMutant) -> bool:
        """Whether tests see the fault, in its build or in another one."""
        own = build_words(self.parameters[folder])
        others = [
            {mutant: found for results in known for mutant, found in results.items()}
            for words, known in self.known.items()
            if words != own
        ]
        return self.results[folder][mutant] or found_elsewhere(mutant, others)

    def left(self) -> list[tuple[Fault, dict[str, int | str]]]:
        """Each fault that no test sees, with the parameters of its build."""
        found: list[tuple[Fault, dict[str, int | str]]] = []
        for folder, results in self.results.items():
            for mutant in results:
                left = mutant.fault, self.parameters[folder]
                if mutant.source and left not in found and not self.seen(folder, mutant):
                    found.append(left)
        return found


def judge(block: str, runs: Runs, looks: Runs = ()) -> Verdicts:
    """The verdicts of the runs of a block."""
    verdicts, met = Verdicts(), dict[Reason, bool]()  # whether it is needed
    source = path_of(block)
    builds = Builds(block, runs, looks)
    for folder, results in builds.results.items():
        path, words = Path(folder), build_words(builds.parameters[folder])
        unseen: dict[CellMutant, Reason | None] = {}
        for mutant in results:
            reason = next((r for r in reasons() if fits(r, block, words, mutant)), None)
            seen = builds.seen(folder, mutant)
            if reason:
                met[reason] = met.get(reason, False) or not seen
            if seen:
                verdicts.killed += 1
            else:
                unseen[mutant] = reason
        if not unseen:
            continue
        ports = equivalence.pair(path, source, builds.parameters[folder], rtl_path())
        compared = equivalence.compared(path, ports, [mutant.number for mutant in unseen])
        for mutant, reason in unseen.items():
            verdict, how = compared[mutant.number]
            survivor = Survivor(label(block, words, mutant), mutant, how)
            if verdict == equivalence.EQUIVALENT:
                verdicts.equivalent += 1
            elif reason:
                verdicts.explained.append((survivor, reason))
            else:
                verdicts.survivors.append(survivor)
                verdicts.undecided += verdict == equivalence.UNDECIDED
    verdicts.stale = [f"{r.block}: {r.line}: {r.mutant}" for r, needed in met.items() if not needed]
    return verdicts


def simulated(folder: Path, block: str, **asked: object) -> Runs:
    """The runs of the tests of a block, with mutants as they are asked for. They wait for others of
    the block, also for those that a killed campaign has left: they would write the same files.
    """
    folder.mkdir()
    request = folder / "request"
    request.write_text(json.dumps({"block": block, "faults": [], "labels": [], **asked}))
    with open(BUILD / f"{block}.lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(f"{block}: waits for other tests of its mutants, which still run", flush=True)
            fcntl.flock(lock, fcntl.LOCK_EX)
        pytest(tests()[block], {"MUTANTS": str(request)}, [lock.fileno()])
    return Run.all(folder)


def measured(
    block: str,
    count: int = MUTANTS,
    seed: int = 1,
    only: str = "",
    survivors: Collection[str] = (),
) -> Verdicts:
    """Run so many mutants of a block against its tests, or against those cocotb tests whose names
    have `only` in them; of these mutants all, or the survivors whose lines are given. Faults that a
    build leaves are then looked for in its other builds.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=BUILD, prefix="run-") as temporary:
        folder, each = Path(temporary), max(1, round(count / builds_of(block)))
        asked = {"seed": seed, "tests": only}
        labels = [survivor.partition(BEFORE_WORDS)[0] for survivor in survivors]
        runs = simulated(folder / "runs", block, count=each, labels=labels, **asked)
        if not runs:
            raise MutationError(f"{block}: no test has made a build of it")
        looks: Runs = ()
        if (left := Builds(block, runs).left()) and builds_of(block) > 1:
            looks = simulated(folder / "looks", block, count=LOOK, faults=left, **asked)
        return judge(block, runs, looks)


def entry_of(verdicts: Verdicts, count: int, seed: int) -> record.Entry:
    """What docs/mutants.toml says of a block."""
    return {
        "mutants": verdicts.different + verdicts.equivalent,
        "seed": seed,
        "asked": count,
        "found": verdicts.killed,
        "equivalent": verdicts.equivalent,
        "survivors": [survivor.text for survivor in verdicts.survivors],
        "explained": [f"{s.text}: {reason.why}" for s, reason in verdicts.explained],
    }


def named(block: str, count: int, seed: int, survivors: Collection[str] = ()) -> Verdicts:
    """As measured; an error begins with the name of the block."""
    try:
        return measured(block, count, seed, survivors=survivors)
    except MutationError as error:
        raise MutationError(f"{block}: {error}") from error


def path_of(block: str) -> Path:
    """The source of a block."""
    return next((ROOT / "rtl").rglob(f"{block}.sv"))


BLOCKS = command.Subjects(
    tests, "is no block that a test simulates by itself", path_of, named, entry_of
)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m mutation.blocks")
    parser.add_argument(
        "names", nargs="*", metavar="BLOCK", help="modules below rtl/ with a test; default: all"
    )
    return command.run(parser, arguments, BLOCKS, MUTANTS)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Which faults inside a module of the host no test of the module sees.

    python -m mutation.host [MODULE …]      mutants of these modules, or of all; see --help

Cosmic Ray (`make cosmicray`) makes the mutants: one operator, comparison, number or the like of
the source is another one. mutation.host_tests runs the tests of host.toml on each of them. What no
test sees is a survivor. It needs a better test, or a reason in host.toml. Nothing proves that a
mutant is equivalent to the module.
"""

import argparse
import fnmatch
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from mutation import command, record
from mutation.block import BUILD, MutationError
from twin.build import ROOT

MUTANTS = 100  # of a module
TABLE = Path(__file__).with_name("host.toml")
COSMIC_RAY = ROOT / "build" / "cosmic_ray"
PATIENCE, LEAST_S = 3, 5  # a run has no end if it takes so many times as without a mutant, and 5 s
UNLIMITED_S = 3600


class NotInstalled(MutationError):
    """Cosmic Ray is not there."""


@dataclass(frozen=True)
class HostMutant:
    """One fault in a module."""

    module: str
    line: int
    old: str  # the line of the source without its indentation
    new: str  # the same line of the mutant, or an empty text if it is gone
    text: str  # of the whole mutant

    @property
    def words(self) -> str:
        """One line for a person."""
        path = path_of(self.module).relative_to(ROOT)
        return f"{path}:{self.line}: {self.old} -> {self.new or '(nothing)'}"


@dataclass(frozen=True)
class Reason:
    """Why no test can find some mutants of a line."""

    module: str
    line: str  # of the source, without its indentation
    mutant: str  # pattern of the line of the mutant
    why: str

    def explains(self, mutant: HostMutant) -> bool:
        """Whether it is about this mutant."""
        return (self.module, self.line) == (mutant.module, mutant.old) and fnmatch.fnmatchcase(
            mutant.new, self.mutant
        )


@dataclass
class Verdicts:
    """What became of the mutants of a module."""

    killed: int = 0
    survivors: list[HostMutant] = field(default_factory=list)  # without a reason
    explained: list[tuple[HostMutant, Reason]] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)  # reasons whose mutants are all found

    @property
    def tried(self) -> int:
        """All mutants."""
        return self.killed + len(self.survivors) + len(self.explained)

    @property
    def words(self) -> str:
        return (
            f"{self.killed} of {self.tried} found, {len(self.survivors)} survivors, "
            f"{len(self.explained)} explained, {len(self.stale)} stale reasons"
        )


@cache
def table() -> Mapping[str, object]:
    """host.toml."""
    return tomllib.loads(TABLE.read_text())


def tests() -> dict[str, list[str]]:
    """{module: files of its tests}"""
    found = table()["tests"]
    assert isinstance(found, dict)
    return found


def reasons() -> list[Reason]:
    """The reasons of host.toml. MutationError names one whose line does not exist."""
    entries = table().get("reason", [])
    assert isinstance(entries, list)
    found = [Reason(**entry) for entry in entries]
    for reason in found:
        lines = path_of(reason.module).read_text().splitlines()
        if reason.line not in [line.strip() for line in lines]:
            raise MutationError(f"host.toml: {reason.module} has no line {reason.line!r}")
    return found


def path_of(module: str) -> Path:
    """The source of a module."""
    return ROOT / "sw" / "host" / (module.replace(".", "/") + ".py")


def difference(module: str, source: str, text: str) -> HostMutant:
    """The mutant that this text is."""
    old, new = source.splitlines(), text.splitlines()
    at = next(n for n, (a, b) in enumerate(zip([*old, ""], [*new, ""])) if a != b)
    same_length = len(old) == len(new)
    return HostMutant(module, at + 1, old[at].strip(), new[at].strip() if same_length else "", text)


def mutants_of(module: str, count: int, seed: int) -> list[HostMutant]:
    """So many mutants of a module, spread over the places of its source; fewer if it has fewer."""
    if not (COSMIC_RAY / "cosmic_ray").exists():
        raise NotInstalled("Cosmic Ray is not installed: make cosmicray")
    made = subprocess.run(
        [sys.executable, "-m", "mutation.host_texts", path_of(module), str(count), str(seed)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, str(COSMIC_RAY)])},
        capture_output=True,
        text=True,
    )
    if made.returncode:
        why = made.stderr.strip().rpartition("\n")[2]
        raise MutationError(f"{module}: Cosmic Ray makes no mutants: {why}")
    source = path_of(module).read_text()
    return [difference(module, source, text) for text in json.loads(made.stdout)]


def runs(
    module: str, texts: Sequence[str], seed: int, longest_s: float
) -> Iterator[tuple[int, str, float]]:
    """(number of the text, the test that failed or "", computing time in s) of each text."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=BUILD, prefix="host-") as folder:
        request = Path(folder) / "request.json"
        asked = {
            "module": module,
            "path": str(path_of(module)),
            "tests": tests()[module],
            "texts": list(texts),
            "seed": seed,
            "longest_s": longest_s,
        }
        request.write_text(json.dumps(asked))
        running = subprocess.Popen(
            [sys.executable, "-m", "mutation.host_tests", str(request)],
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
            raise MutationError(f"{module}: the runs ended with exit code {running.returncode}")


def measured(module: str, count: int = MUTANTS, seed: int = 1) -> Verdicts:
    """Run the tests of a module on so many mutants of it."""
    known = [reason for reason in reasons() if reason.module == module]
    mutants, source = mutants_of(module, count, seed), path_of(module).read_text()
    [(_, failed, seconds)] = runs(module, [source], seed, UNLIMITED_S)
    if failed:
        raise MutationError(f"{module}: without a mutant {failed} fails")
    verdicts, met = Verdicts(), dict[Reason, bool]()  # whether it is needed
    longest_s = PATIENCE * seconds + LEAST_S
    for number, failed, _ in runs(module, [mutant.text for mutant in mutants], seed, longest_s):
        mutant = mutants[number]
        reason = next((reason for reason in known if reason.explains(mutant)), None)
        if reason:
            met[reason] = met.get(reason, False) or not failed
        if failed:
            verdicts.killed += 1
        elif reason:
            verdicts.explained.append((mutant, reason))
        else:
            verdicts.survivors.append(mutant)
    verdicts.stale = [
        f"{r.module}: {r.line}: {r.mutant}" for r, needed in met.items() if not needed
    ]
    return verdicts


def entry_of(verdicts: Verdicts, count: int, seed: int) -> record.Entry:
    """What docs/mutants.toml says of a module."""
    return {
        "mutants": verdicts.tried,
        "seed": seed,
        "asked": count,
        "found": verdicts.killed,
        "survivors": [mutant.words for mutant in verdicts.survivors],
        "explained": [f"{mutant.words}: {reason.why}" for mutant, reason in verdicts.explained],
    }


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m mutation.host")
    parser.add_argument(
        "names", nargs="*", metavar="MODULE", help="modules of host.toml; default: all"
    )
    unknown = "has no tests in sw/mutation/host.toml"
    measure = measured
    return command.run(parser, arguments, tests(), unknown, MUTANTS, measure, entry_of)


if __name__ == "__main__":
    sys.exit(main())

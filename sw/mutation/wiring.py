# SPDX-License-Identifier: Apache-2.0
"""Which connections of the block diagrams could be cut, inverted or swapped without a test that
fails.

python -m mutation.wiring [FILE …]      the mutants of these diagrams, or of all; see --help

Each design of DESIGNS has tests in tb/wiring, which run on a build that contains all mutants of one
diagram. A survivor is an error unless wiring.toml has its reason; a reason for a mutant that does
not exist any more, or that a test finds, is an error as well.
"""

import argparse
import fnmatch
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from mutation.connections import RTL, Connection, diagrams, of_diagram
from mutation.library import library
from mutation.mutants import Design, Mutant
from twin.build import ROOT

REASONS = Path(__file__).with_name("wiring.toml")
DESIGNS = {  # diagrams of a design; all others are in the node
    "relay": ("relay.sv", "relay_bridge.sv"),
    "process_link": ("process_link.sv",),
    "axis_inputs": ("axis_inputs.sv",),
    "peripherals": (
        *("peripherals.sv", "ps2_port.sv", "ps2_pass.sv", "peer_port.sv"),
        "angle_sensor_port.sv",
    ),
    "i2c_port": ("i2c_port.sv",),
    "display_port": ("display_port.sv",),
}
MOST = 400  # connections of several diagrams in one build
ABSENT = {  # instances that a design does not have, and ports for a carrier that it does not have
    "node": (
        *("g_serial_core.", "g_link.g_udp.", "g_link.g_spi.", "u_link.udp_"),
        *("u_link.link_cs_n", "u_link.link_sclk", "u_link.link_mosi", "u_link.link_miso"),
    ),
    "relay": ("g_segments.",),
}
ZERO = re.compile(r"(\d*'[bdh]?0+|0)")
ONE = re.compile(r"(1'b1|1'd1)")
Place = tuple[Path, str]  # a diagram and an instance in it
Report = Callable[[Mutant, str], None]  # takes a mutant and the test that finds it, "" for none


def design_of(file: Path) -> str:
    """The design in which a diagram is tested."""
    return next((top for top, names in DESIGNS.items() if file.name in names), "node")


def absent(connection: Connection) -> bool:
    """Whether the design in which a diagram is tested has nothing behind this connection: no test
    can find its faults, which are not run.
    """
    port = f"{connection.instance}.{connection.port}"
    return port.startswith(ABSENT.get(design_of(connection.file), ()))


@cache
def reasons() -> dict[str, str]:
    """{pattern of names of mutants: why no test can find them}."""
    found: dict[str, str] = tomllib.loads(REASONS.read_text())
    return found


def constant(mutant: Mutant) -> bool:
    """Whether the connection already is the constant that it is tied to."""
    rule = {"tied to 0": ZERO, "tied to 1": ONE}.get(mutant.what)
    return bool(rule and rule.fullmatch(mutant.connection.expression))


@dataclass
class Verdicts:
    """What became of the mutants."""

    killed: dict[str, str] = field(default_factory=dict)  # name: test
    survivors: list[Mutant] = field(default_factory=list)
    explained: dict[str, str] = field(default_factory=dict)  # name: pattern of its reason
    stale: list[str] = field(default_factory=list)  # patterns that explain what a test finds
    left: int = 0  # mutants that were not run

    @property
    def failures(self) -> int:
        return len(self.survivors) + len(self.stale)

    def add(self, other: "Verdicts") -> None:
        """Add the verdicts of other mutants."""
        self.killed |= other.killed
        self.survivors += other.survivors
        self.explained |= other.explained
        self.stale += other.stale
        self.left += other.left

    @property
    def words(self) -> str:
        return (
            f"{len(self.killed)} found, {len(self.explained)} explained, "
            f"{len(self.survivors)} survivors, {len(self.stale)} stale reasons, {self.left} not run"
        )


def pattern_of(name: str) -> str | None:
    """The pattern in wiring.toml that fits a mutant."""
    return next((p for p in reasons() if fnmatch.fnmatchcase(name, p)), None)


def git(*words: str) -> bytes | None:
    """What git says, None if it fails."""
    said = subprocess.run(["git", *words], cwd=ROOT, capture_output=True)
    return said.stdout if said.returncode == 0 else None


def base() -> str | None:
    """The commit with which the diagrams are compared: where the branch left main; on main itself
    the commit before the last one. None without a history.
    """
    head, left = git("rev-parse", "HEAD"), git("merge-base", "HEAD", "main")
    if left is None or left == head:
        left = git("rev-parse", "HEAD~1")
    return left.decode().strip() if left else None


def key(connection: Connection) -> tuple[str, str, str]:
    """What makes a connection the same in two versions of a file."""
    expression = re.sub(r"\s+", "", connection.expression)
    return connection.instance, connection.port, expression


def changed() -> set[Connection]:
    """The connections that differ from the base."""
    found: set[Connection] = set()
    commit = base()
    if not commit or git("diff", "--quiet", commit, "--", "rtl") is not None:
        return found
    for file in diagrams():
        old = git("show", f"{commit}:{file.relative_to(ROOT)}")
        if old == file.read_bytes():
            continue
        before = set()
        if old is not None:
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / file.name).write_bytes(old)
                before = {key(c) for c in of_diagram(Path(folder) / file.name)}
        found |= {c for c in of_diagram(file) if key(c) not in before}
    return found


def campaign(
    design: Design, mutants: Sequence[Mutant], top: str, jobs: int
) -> Iterator[tuple[Mutant, str]]:
    """Each mutant, and the test that finds it."""
    words = [sys.executable, "-m", "tb.wiring.parameters", top]
    said = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True)
    values: Mapping[str, int] = tomllib.loads(said.stdout)
    path = library(top, values, design)
    by_name = {m.name: m for m in mutants}
    lines = [
        f"{m.name};{';'.join(map(str, m.selected))};{m.connection.instance}\n" for m in mutants
    ]
    command = [sys.executable, "-m", "tb.wiring.campaign", top, str(path), str(jobs)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin and process.stdout
        process.stdin.writelines(lines)
        process.stdin.close()
        for line in process.stdout:
            name, test = line.rstrip("\n").rsplit(";", 1)
            yield by_name[name], test
    if process.returncode:
        raise RuntimeError(f"the campaign of {top} ended with {process.returncode}")


def judge(verdicts: Verdicts, mutant: Mutant, test: str) -> None:
    """Add the result of one mutant."""
    pattern = pattern_of(mutant.name)
    if test:
        verdicts.killed[mutant.name] = test
        if pattern:
            verdicts.stale.append(f"{mutant.name}: {test} finds it, but it has a reason")
    elif pattern:
        verdicts.explained[mutant.name] = pattern
    else:
        verdicts.survivors.append(mutant)


def together(files: Iterable[Path], most: int = MOST) -> list[list[Path]]:
    """Diagrams that share a build, which costs as much as the tests of some hundred mutants: of one
    design, and with so many connections at most.
    """
    groups: list[list[Path]] = []
    left = 0  # connections for which the last group has room
    for file in sorted(files, key=design_of):
        left -= (size := len(of_diagram(file)))
        if groups and design_of(groups[-1][0]) == design_of(file) and left >= 0:
            groups[-1].append(file)
        else:
            groups.append([file])
            left = most - size
    return groups


def silent(mutant: Mutant, test: str) -> None:
    """Print nothing of the result of a mutant."""


def told(mutant: Mutant, test: str) -> None:
    """Print the result of a mutant."""
    print(f"{mutant.name}: {test or 'NO TEST'}", file=sys.stderr, flush=True)
    if not test and not pattern_of(mutant.name):
        print(f"{mutant.place}: {mutant.name}: no test sees it", file=sys.stderr, flush=True)


def of_instances(
    files: Iterable[Path],
    chosen: Callable[[Connection], bool],
    clocks: bool = False,
    jobs: int = 2,
    seconds: float = float("inf"),
    report: Report = silent,
    due: Callable[[Mutant], bool] = lambda m: True,
) -> Iterator[tuple[Place, Verdicts]]:
    """Run the mutants of diagrams that are due, one build after the other; none is begun after so
    many seconds. Each instance with its verdicts, as soon as all its mutants have run; at the end
    those of which some are left.
    """
    end = time.monotonic() + seconds
    for group in together(files):
        design, mutants = Design.of(group, clocks, chosen), list[Mutant]()
        places: dict[Place, Verdicts] = defaultdict(Verdicts)
        for mutant in filter(due, design.mutants()):
            verdicts = places[place_of(mutant.connection)]
            if absent(mutant.connection):
                judge(verdicts, mutant, "")
            elif not constant(mutant):
                mutants.append(mutant)
                verdicts.left += 1
        yield from [(place, places.pop(place)) for place in list(places) if not places[place].left]
        if mutants and time.monotonic() < end:
            for mutant, test in campaign(design, mutants, design_of(group[0]), jobs):
                place = place_of(mutant.connection)
                places[place].left -= 1
                judge(places[place], mutant, test)
                report(mutant, test)
                if not places[place].left:
                    yield place, places.pop(place)
                if time.monotonic() > end:
                    break
        yield from places.items()


def run(
    files: Iterable[Path],
    chosen: Callable[[Connection], bool] = lambda c: True,
    clocks: bool = False,
    jobs: int = 2,
    seconds: float = float("inf"),
    report: Report = silent,
) -> Verdicts:
    """The verdicts of all mutants of diagrams together, as of_instances runs them."""
    verdicts = Verdicts()
    for _, of_instance in of_instances(files, chosen, clocks, jobs, seconds, report):
        verdicts.add(of_instance)
    return verdicts


def place_of(connection: Connection) -> Place:
    """The diagram and the instance of a connection."""
    return connection.file, connection.instance


def files_of(parser: argparse.ArgumentParser, names: Sequence[str]) -> list[Path]:
    """The diagrams of these names below rtl/, or all; a name that is none ends the program."""
    files = [RTL / name for name in names] or list(diagrams())
    if missing := [name for name, file in zip(names, files) if not file.is_file()]:
        parser.error(f"there is no rtl/{missing[0]}")
    return files


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m mutation.wiring")
    parser.add_argument("files", nargs="*", help="diagrams below rtl/; default: all")
    parser.add_argument("--list", action="store_true", help="print the mutants, run nothing")
    parser.add_argument("--changed", action="store_true", help="connections that are new here")
    parser.add_argument("--clocks", action="store_true", help="the clocks in place of all others")
    parser.add_argument("-j", type=int, default=2, metavar="JOBS")
    parser.add_argument("-k", default="", metavar="PART", help="connections with this in the name")
    options = parser.parse_args(arguments)
    files = files_of(parser, options.files)
    new = changed() if options.changed else None

    def chosen(connection: Connection) -> bool:
        return options.k in connection.name and (new is None or connection in new)

    if options.list:
        for mutant in Design.of(files, options.clocks, chosen).mutants():
            print(f"{mutant.place}: {mutant.name}")
        return 0
    verdicts = run(files, chosen, options.clocks, options.j, report=told)
    print(verdicts.words)
    print(*verdicts.stale, sep="\n", end="")
    return int(verdicts.failures > 0)


if __name__ == "__main__":
    sys.exit(main())

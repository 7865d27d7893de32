# SPDX-License-Identifier: Apache-2.0
"""Coverage of the RTL: the tests of the blocks run under Verilator, which counts how often each
line, each branch and each change of a bit was reached.

A branch is an arm of an if, of a case or of a conditional operator. The counts of a point are added
over all tests, all parameters and all instances of its module. Simulations of FORMAL blocks do not
exist, so properties do not count; neither do benches and the soft cores of others.
"""

import ast
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from code_coverage.reached import Arm, Reached
from twin.build import ROOT, SHORT_RUNS

RTL = ROOT / "rtl"
TESTS = ROOT / "tb"
FOLDER = ROOT / "build" / "coverage" / "rtl"  # a folder for each file of tests
COMPLETE = "complete.json"  # file in it: the tests passed, with these contents of their sources
ARMS = ("elsif", "case")  # that Verilator counts as lines, and are branches
LONGEST_S = 3 * 3600  # of a file of tests
SIMULATES = re.compile(r"^from tb(\.bench import (.*|\([^)]*)\brun\b| import bench$)", re.MULTILINE)
POINT = re.compile(r"C '(.*)' (\d+)")
# Python 3.11 counts the depth of what ast.parse makes for all threads together. If another thread
# begins one while the garbage of this one is collected, it ends with a SystemError.
parsing = threading.Lock()


def directories() -> list[str]:
    """The directories of tests of blocks."""
    return [*sorted(path.name for path in RTL.iterdir() if path.is_dir()), "system"]


def test_files() -> list[Path]:
    """The files of tests that simulate a block."""
    found = (path for name in directories() for path in sorted((TESTS / name).glob("test_*.py")))
    return [path for path in found if SIMULATES.search(path.read_text())]


def folder_of(test: Path) -> Path:
    """Where the counts of a file of tests are."""
    return FOLDER / f"{test.parent.name}.{test.stem}"


def imported(test: Path) -> set[Path]:
    """A file of tests and all models that it imports."""
    found: set[Path] = set()
    left = [test]
    while left:
        path = left.pop()
        if path in found or not path.is_file():
            continue
        found.add(path)
        with parsing:
            tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tb":
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
                left += [ROOT / f"{str(name).replace('.', '/')}.py" for name in names]
    return found


def contents(path: Path) -> str:
    """A name for the contents of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def versions(test: Path, blocks: Iterable[Path]) -> dict[str, str]:
    """{path: contents} of what decides the counts of a file of tests of these blocks."""
    paths = {ROOT / "requirements.lock", *imported(test), *blocks}
    return {str(path.relative_to(ROOT)): contents(path) for path in sorted(paths)}


def gathered(test: Path) -> bool:
    """Whether the counts of a file of tests are there, and of these sources."""
    stamp = folder_of(test) / COMPLETE
    if not stamp.exists():
        return False
    then: dict[str, str] = json.loads(stamp.read_text())
    blocks = [ROOT / name for name in then if name.endswith(".sv")]
    return then == versions(test, blocks)


def run(test: Path) -> str:
    """Run a file of tests. Returns the last lines of what went wrong, or nothing."""
    before, folder = versions(test, RTL.rglob("*.sv")), folder_of(test)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(test)],
        cwd=ROOT,
        env={**os.environ, SHORT_RUNS: "1", "RTL_COVERAGE": str(folder)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
    )
    if done.returncode:
        return f"{test.relative_to(ROOT)}: {done.stdout[-500:].strip()}"
    used = reached(folder.glob("*.dat"))
    stamp = {n: v for n, v in before.items() if not n.endswith(".sv") or n in used}
    (folder / COMPLETE).write_text(json.dumps(stamp, indent=1))
    return ""


def gather(tests: Iterable[Path], jobs: int, until: float = float("inf")) -> list[str]:
    """Run the files of tests whose counts are missing, and begin none after the time `until` of
    time.monotonic(). Prints each that has ended, and returns what went wrong.
    """
    missing, ended = [test for test in tests if not gathered(test)], itertools.count(1)

    def in_time(test: Path) -> str:
        if time.monotonic() >= until:
            return ""
        fault = run(test)
        words = "FAILED" if fault else "passed"
        print(f"{next(ended)} of {len(missing)}: {test.stem} {words}", flush=True)
        return fault

    with ThreadPoolExecutor(jobs) as pool:
        return [fault for fault in pool.map(in_time, missing) if fault]


def of_tests(tests: Iterable[Path]) -> dict[str, Reached]:
    """What was reached in those of these files of tests that have been gathered."""
    done = [folder_of(test) for test in tests if gathered(test)]
    return reached(path for folder in done for path in sorted(folder.glob("*.dat")))


def lines_of(text: str) -> tuple[int, ...]:
    """The lines of `3-5,8`."""
    spans = [part.partition("-") for part in text.split(",") if part]
    return tuple(n for a, _, b in spans for n in range(int(a), int(b or a) + 1))


def counts(files: Iterable[Path]) -> dict[str, int]:
    """The counts of all keys in files that Verilator has written."""
    found: dict[str, int] = defaultdict(int)
    for file in files:
        for key, count in POINT.findall(file.read_text()):
            found[key] += int(count)
    return found


def reached(files: Iterable[Path]) -> dict[str, Reached]:
    """{path of a source: what was reached}, from files that Verilator has written. A line counts as
    reached if anything in it was; blocks are added over their instances and parameters.
    """
    found: dict[str, Reached] = defaultdict(Reached)
    for key, count in counts(files).items():
        values = dict(part.split("\2", 1) for part in key.split("\1") if part)
        file = Path(values["f"])
        if not file.is_relative_to(RTL):
            continue
        into, what = found[str(file.relative_to(ROOT))], values["o"]
        arm = Arm(int(values["l"]), int(values["n"]), what, lines_of(values.get("S", "")))
        if values["t"] == "toggle":
            into.toggles[arm] = into.toggles.get(arm, 0) + count
            continue
        for line in arm.lines:
            into.add_line(line, count)
        if values["t"] == "branch" or what in ARMS:
            into.arms[arm] = into.arms.get(arm, 0) + count
    for name, one in found.items():
        one.exclude((ROOT / name).read_text())
    return dict(found)


def not_simulated(found: Iterable[str]) -> list[str]:
    """The sources that no test of a block simulates."""
    sources = {str(path.relative_to(ROOT)) for path in RTL.rglob("*.sv")}
    return sorted(sources - set(found))

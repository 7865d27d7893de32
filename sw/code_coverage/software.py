# SPDX-License-Identifier: Apache-2.0
"""Coverage of the firmware and of the host package by the tests of tb/firmware and tb/host.

The firmware is the one that is compiled for this computer, by gcc, which counts for gcov; the host
package is measured by coverage.py. The firmware on the soft core, which the tests of nodes execute,
does not count.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from code_coverage.reached import Arm, Reached, merged
from twin.build import ROOT
from twin.compiled.host_library import COVERAGE

FOLDER = ROOT / "build" / "coverage" / "software"  # a folder for each folder of tests
FIRMWARE = ROOT / "sw" / "firmware"
HOST = ROOT / "sw" / "host"
TESTS = [ROOT / "tb" / name for name in ("firmware", "host")]
DEPENDS = [ROOT / "tb" / "fakes", FIRMWARE, HOST, ROOT / "sw" / "twin" / "compiled"]
COMPLETE = "complete"  # file in it: the tests passed with the sources of this digest
NOTES = "gcov"  # folder in it: notes and counts of gcc
COUNTS = "counts"  # how the names of the files of coverage.py begin
LONGEST_S = 3 * 3600


def digest(tests: Path) -> str:
    """A name for all sources that decide the counts of a folder of tests."""
    folders = (tests, *DEPENDS)
    files = (path for folder in folders for path in sorted(folder.rglob("*.*")) if path.is_file())
    total = hashlib.sha256()
    for path in (ROOT / "requirements.lock", *files):
        if path.suffix not in (".pyc", ".so"):
            total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()


def folder_of(tests: Path) -> Path:
    """Where the counts of a folder of tests are."""
    return FOLDER / tests.name


def run(tests: Path) -> str:
    """Run the tests of a folder, unless their counts are there. Returns the last lines of what went
    wrong, or nothing.
    """
    now, folder = digest(tests), folder_of(tests)
    stamp = folder / COMPLETE
    if stamp.exists() and stamp.read_text() == now:
        return ""
    print(f"tests of {tests.name}: they take minutes", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    (folder / NOTES).mkdir(parents=True)
    done = coverage(
        folder / COUNTS,
        *("run", "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tests)),
        **{COVERAGE: str(folder / NOTES)},
    )
    if done.returncode:
        return f"{tests.name}: {done.stdout[-500:].strip()}"
    stamp.write_text(now)
    return ""


def gather(jobs: int) -> list[str]:
    """Run the tests whose counts are missing. Returns what went wrong."""
    with ThreadPoolExecutor(jobs) as pool:
        faults = [fault for fault in pool.map(run, TESTS) if fault]
    if not faults:
        folders = [str(folder_of(tests)) for tests in TESTS]
        coverage(FOLDER / COUNTS, "combine", "--keep", *folders).check_returncode()
        coverage(FOLDER / COUNTS, "json", "-q", "-o", str(FOLDER / "host.json")).check_returncode()
    return faults


def coverage(data: Path, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
    """A command of coverage.py with this file of counts, and more in its environment."""
    return subprocess.run(
        [sys.executable, "-m", "coverage", *words],
        cwd=ROOT,
        env={**os.environ, "COVERAGE_FILE": str(data), **more},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
    )


def of_notes(notes: Path) -> dict[str, Reached]:
    """What was reached of the sources in one object, from the notes that gcc made of it and the
    counts beside them.
    """
    done = subprocess.run(
        ["gcov", "--branch-probabilities", "--json-format", "--stdout", notes.name],
        cwd=notes.parent,
        stdin=subprocess.DEVNULL,
        check=True,
        capture_output=True,
        text=True,
    )
    found: dict[str, Reached] = defaultdict(Reached)
    for file in json.loads(done.stdout)["files"]:
        path = Path(file["file"])
        if not path.is_relative_to(FIRMWARE):
            continue
        into = found[str(path.relative_to(ROOT))]
        for line in file["lines"]:
            number = line["line_number"]
            into.add_line(number, line["count"])
            for n, branch in enumerate(line["branches"]):
                what = f"way {n + 1} of {len(line['branches'])}"
                arm = Arm(number, n, what)
                into.arms[arm] = into.arms.get(arm, 0) + branch["count"]
    return found


def excluded(found: dict[str, Reached]) -> dict[str, Reached]:
    """The same without what has a reason."""
    for name, one in found.items():
        one.exclude((ROOT / name).read_text())
    return found


def firmware() -> dict[str, Reached]:
    """{path of a source: what was reached} of the firmware."""
    folders = [folder_of(tests) / NOTES for tests in TESTS]
    notes = [path for folder in folders for path in sorted(folder.glob("*.gcno"))]
    return excluded(merged(of_notes(path) for path in notes))


def host() -> dict[str, Reached]:
    """{path of a source: what was reached} of the host package."""
    found = {}
    for name, file in json.loads((FOLDER / "host.json").read_text())["files"].items():
        one = found[name] = Reached()
        for count, lines in ((1, file["executed_lines"]), (0, file["missing_lines"])):
            for line in lines:
                one.add_line(line, count)
        for count, ways in ((1, file["executed_branches"]), (0, file["missing_branches"])):
            for line, target in ways:
                what = f"to line {target}" if target > 0 else "to the end"
                one.arms[Arm(line, target, what)] = count
    return excluded(found)


def not_built(found: Iterable[str]) -> list[str]:
    """The C sources of the firmware that no test has compiled."""
    sources = {str(path.relative_to(ROOT)) for path in FIRMWARE.rglob("*.c")}
    return sorted(sources - set(found))

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

FOLDER = ROOT / "build" / "coverage" / "software"
FIRMWARE = ROOT / "sw" / "firmware"
HOST = ROOT / "sw" / "host"
TESTS = [ROOT / "tb" / name for name in ("firmware", "host")]
DEPENDS = [*TESTS, ROOT / "tb" / "fakes", FIRMWARE, HOST, ROOT / "sw" / "twin" / "compiled"]
COMPLETE = "complete"  # file: the tests passed with the sources of this digest
LONGEST_S = 3 * 3600


def digest() -> str:
    """A name for all sources that decide the counts."""
    lock = ROOT / "requirements.lock"
    files = (path for folder in DEPENDS for path in sorted(folder.rglob("*.*")) if path.is_file())
    total = hashlib.sha256()
    for path in (lock, *files):
        if path.suffix not in (".pyc", ".so"):
            total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()


def run(tests: Path) -> str:
    """Run the tests of a folder. Returns the last lines of what went wrong, or nothing."""
    command = [sys.executable, "-m", "coverage", "run", "-m", "pytest"]
    done = subprocess.run(
        [*command, "-q", "-p", "no:cacheprovider", str(tests)],
        cwd=ROOT,
        env={
            **os.environ,
            COVERAGE: str(FOLDER / "gcov"),
            "COVERAGE_FILE": str(FOLDER / "host"),
        },
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
    )
    return f"{tests.name}: {done.stdout[-500:].strip()}" if done.returncode else ""


def gather(jobs: int) -> list[str]:
    """Run all tests, unless their counts are there. Returns what went wrong."""
    now, stamp = digest(), FOLDER / COMPLETE
    if stamp.exists() and stamp.read_text() == now:
        return []
    shutil.rmtree(FOLDER, ignore_errors=True)
    (FOLDER / "gcov").mkdir(parents=True)
    with ThreadPoolExecutor(jobs) as pool:
        faults = [fault for fault in pool.map(run, TESTS) if fault]
    if not faults:
        coverage("combine", "--keep")
        coverage("json", "-q", "-o", str(FOLDER / "host.json"))
        stamp.write_text(now)
    return faults


def coverage(*words: str) -> None:
    """Call a command of coverage.py on the counts of the host package."""
    subprocess.run(
        [sys.executable, "-m", "coverage", *words],
        cwd=ROOT,
        env={**os.environ, "COVERAGE_FILE": str(FOLDER / "host")},
        stdin=subprocess.DEVNULL,
        check=True,
        capture_output=True,
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
    return excluded(merged(of_notes(notes) for notes in sorted((FOLDER / "gcov").glob("*.gcno"))))


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

# SPDX-License-Identifier: Apache-2.0
"""Latency claims in the headers of the RTL that no test of that name holds.

A header line `// latency  3 cycles from step to corrected` needs a test `latency_is_3…` in the test
file of the module: every number that is followed by "cycles" must be in the name of such a test,
and a latency that is a formula needs one too. A latency that only refers to other
modules (`see …`) or does not exist (`none …`) needs none.

    python -m tools.check_latency      lists the claims without a test; exit code 1 if there is one
"""

import re
import sys
from pathlib import Path

from tables import modules
from tools import ROOT, exit_code

NO_CLAIM = re.compile(r"(see|none)\b")


def tests_of(path: Path) -> set[str]:
    """Names of all test functions in the test files that may hold a claim of this module."""
    _, test = modules.check_of(path)
    files = [test] if test else []
    if path.parent == ROOT / "rtl":  # a block diagram: its tests are those of whole systems
        files = [p.relative_to(ROOT) for p in (ROOT / "tb").rglob("test_*.py")]
    found: set[str] = set()
    for file in files:
        if (ROOT / file).is_file():
            text = (ROOT / file).read_text(encoding="utf-8")
            found |= set(re.findall(r"def (?:test_)?(latency_is_\w+)", text))
    return found


def untested(path: Path) -> list[str]:
    """`file: claim` for each latency of a module that no test of that name holds."""
    text = path.read_text(encoding="utf-8")
    _, facts = modules.header(text, str(path.relative_to(ROOT)))
    claim = facts.get("latency", "")
    if not claim or NO_CLAIM.match(claim):
        return []
    tests = tests_of(path)
    numbers = re.findall(r"(?<![\w.(])(?<![-+*/] )(\d+)(?= cycles?\b)", claim)
    missing = [n for n in numbers if not any(n in test.split("_") for test in tests)]
    if not tests:
        return [f"{path.relative_to(ROOT)}: no test latency_is_…: {claim}"]
    return [f"{path.relative_to(ROOT)}: no test latency_is_{n}" for n in missing]


def problems() -> list[str]:
    """The untested claims of all modules under rtl/."""
    return [row for path in sorted((ROOT / "rtl").rglob("*.sv")) for row in untested(path)]


def main() -> int:
    return exit_code(problems())


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Measure what the tests reach of RTL, firmware and host package, and write docs/coverage.md.

    python -m code_coverage [--jobs N] [--minutes M]      (make coverage)

Tests whose sources have not changed since they were measured are not run again, so a run that was
interrupted continues. The page lists the tests for which there was no time. The exit code is 1 if a
test failed, if a reason explains nothing, or if there was no time for all.
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import date

from code_coverage import rtl, software
from code_coverage.page import page
from code_coverage.reached import KINDS, total
from twin.build import ROOT

PAGE = ROOT / "docs" / "coverage.md"


def measured() -> str:
    """When this is, and of which version."""
    said = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True
    )
    version = said.stdout.strip() or "an unknown version"
    return f"Measured on {date.today().isoformat()}, version {version}."


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m code_coverage", description="Measure what the tests reach."
    )
    parser.add_argument("--jobs", type=int, default=2, help="tests at a time (default 2)")
    parser.add_argument(
        "--minutes", type=float, default=float("inf"), help="after which no further test begins"
    )
    options = parser.parse_args(arguments)
    until = time.monotonic() + 60 * options.minutes
    tests = rtl.test_files()
    faults = software.gather(options.jobs) + rtl.gather(tests, options.jobs, until)
    for fault in faults:
        print(fault, file=sys.stderr)
    if faults:
        return 1
    blocks, firmware, host = rtl.of_tests(tests), software.firmware(), software.host()
    parts = {"RTL": blocks, "firmware": firmware, "host": host}
    absent = [*rtl.not_simulated(blocks), *software.not_built(firmware)]
    left = [str(test.relative_to(ROOT)) for test in tests if not rtl.gathered(test)]
    text = page(blocks, firmware, host, absent, left, measured(), ROOT)
    PAGE.write_text(text, encoding="utf-8")
    stale = [
        f"{name}:{line}: everything here is reached, its reason must go"
        for files in parts.values()
        for name, one in files.items()
        for line in one.stale
    ]
    for words in stale:
        print(words, file=sys.stderr)
    for title, files in parts.items():
        shares = (f"{total(files.values(), kind).percent:.2f} % {kind}" for kind in KINDS)
        print(f"{title}: {', '.join(shares)}")
    print(PAGE.relative_to(ROOT))
    print(f"{len(left)} of {len(tests)} files of tests of blocks are not measured" if left else "")
    return 1 if stale or left else 0


if __name__ == "__main__":
    sys.exit(main())

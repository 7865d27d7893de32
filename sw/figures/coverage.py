# SPDX-License-Identifier: Apache-2.0
"""Figures of the coverage of the RTL by the tests of its blocks; `make coverage` names what they do
not reach.
"""

from code_coverage import rtl
from code_coverage.reached import total
from figures.common import Figure, Quick, console
from twin import BuildError

JOBS = 2
SMALL = ("serial/test_half_duplex.py", "position/test_shift_delay.py")
QUICK = Quick({"whole": False}, "two small blocks")


def percent(kind: str, whole: bool) -> float:
    """The share of the lines or branches of all blocks, or of two, that their tests reach."""
    tests = rtl.test_files() if whole else [rtl.TESTS / name for name in SMALL]
    if faults := rtl.gather(tests, JOBS):
        raise BuildError("; ".join(faults))
    files = rtl.of_tests(tests)
    if stale := [f"{name}:{line}" for name, one in files.items() for line in one.stale]:
        raise BuildError(f"reasons that explain nothing: {', '.join(stale)}")
    reached = total(files.values(), kind)
    console.print(f"{kind}: {reached.reached} of {reached.total} in {len(files)} files")
    return reached.percent


def coverage_line_pct(whole: bool = True) -> float:
    return percent("line", whole)


def coverage_branch_pct(whole: bool = True) -> float:
    return percent("branch", whole)


FIGURES = {
    "coverage_line_pct": Figure(
        coverage_line_pct,
        "%",
        "lines of the RTL that the tests of the blocks execute, under Verilator; those that no "
        "input can reach have a reason beside them and do not count",
        ">= 98",
        QUICK,
        2,
    ),
    "coverage_branch_pct": Figure(
        coverage_branch_pct,
        "%",
        "arms of if, case and conditional operators of the RTL that the tests of the blocks take; "
        "those that no input can reach have a reason beside them and do not count",
        ">= 95",
        QUICK,
        2,
    ),
}

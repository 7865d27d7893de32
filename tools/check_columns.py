# SPDX-License-Identifier: Apache-2.0
"""Lines of more than 100 columns in SystemVerilog, C and C++; the formatters leave comments as they
are, and some long lists. ruff finds those of Python.

    python -m tools.check_columns          lists them; exit code 1 when there is any
"""

import sys

from tools import ROOT, exit_code

COLUMNS = 100
FOLDERS = ("rtl", "tb", "sw", "constraints")
KINDS = {".sv", ".c", ".h", ".cpp"}


def problems() -> list[str]:
    """`file:line: columns` of each line that is too long."""
    paths = sorted(path for name in FOLDERS for path in (ROOT / name).rglob("*.*"))
    return [
        f"{path.relative_to(ROOT)}:{n}: {len(line)}"
        for path in paths
        if path.suffix in KINDS
        for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > COLUMNS
    ]


def main() -> int:
    return exit_code(f"{row} columns, {COLUMNS} at most" for row in problems())


if __name__ == "__main__":
    sys.exit(main())

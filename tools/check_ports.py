# SPDX-License-Identifier: Apache-2.0
"""Ports and parameters of the RTL that state neither a unit nor a meaning.

Every port and every parameter of every module has a line of its own, and a comment on that line or
on the line above it. `clk` and `rst` need none.

    python -m tools.check_ports          lists the bare ones; exit code 1 when there is any
"""

import re
import sys
from pathlib import Path

from tools import ROOT, exit_code

NEEDS_NONE = {"clk", "rst"}
DECLARATION = re.compile(r"\s*(?:input|output|inout|parameter)\b")
NAME = re.compile(r"(\w+)\s*(?:=[^,/]*)?,?\s*$")


def module_head(lines: list[str]) -> range:
    """Line indices between `module` and the `);` that ends its ports."""
    begin = next((n for n, line in enumerate(lines) if re.match(r"module\s", line)), len(lines))
    end = next((n for n in range(begin, len(lines)) if re.match(r"\s*\);", lines[n])), len(lines))
    return range(begin, end)


def bare(path: Path) -> list[str]:
    """`file:line: name` of each port and parameter of a file without a comment."""
    lines, found = path.read_text(encoding="utf-8").splitlines(), []
    for n in module_head(lines):
        code, slashes, comment = lines[n].partition("//")
        above = lines[n - 1].strip()
        name = NAME.search(code.rstrip())
        if not DECLARATION.match(code) or (name and name.group(1) in NEEDS_NONE):
            continue
        stated = comment.strip() if slashes else above.removeprefix("//") * above.startswith("//")
        if not re.search(r"\w", stated) or stated.strip().startswith("verilator"):
            found.append(f"{path.relative_to(ROOT)}:{n + 1}: {name.group(1) if name else code}")
    return found


def problems() -> list[str]:
    """The bare ports and parameters of all modules under rtl/."""
    return [row for path in sorted((ROOT / "rtl").rglob("*.sv")) for row in bare(path)]


def main() -> int:
    return exit_code(f"{row} states no unit and no meaning" for row in problems())


if __name__ == "__main__":
    sys.exit(main())

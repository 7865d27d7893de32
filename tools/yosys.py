# SPDX-License-Identifier: Apache-2.0
"""Yosys's command line, which its Python package lacks.

python tools/yosys.py "command; command" …    prints what Yosys prints; exit code 1 after an error
"""

import sys

from pyosys import libyosys  # type: ignore[import-untyped]


def main() -> None:
    if not sys.argv[1:]:
        sys.exit(__doc__.strip())
    design = libyosys.Design()
    for command in ";".join(sys.argv[1:]).split(";"):
        if command.strip():
            design.run_pass(command.strip())


if __name__ == "__main__":
    main()

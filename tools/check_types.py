# SPDX-License-Identifier: Apache-2.0
"""The strict type check of all Python that ships or measures: mypy --strict without an error.

python -m tools.check_types [PACKAGE …]      prints mypy's rows; exit code 1 when there is any
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("moire", "twin", "firmware", "experiments", "figures", "fuzz", "tables", "tools")
SEARCH = ("sw/host", "sw", ".")


def problems(packages: tuple[str, ...] = PACKAGES) -> list[str]:
    """The errors that mypy reports, one row each."""
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary"]
    for package in packages:
        command += ["-p", package]
    environment = os.environ | {"MYPYPATH": os.pathsep.join(str(ROOT / part) for part in SEARCH)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    rows = [row for row in done.stdout.splitlines() if ": error:" in row]
    if done.returncode and not rows:
        raise RuntimeError(f"mypy failed: {(done.stderr or done.stdout).strip()[-300:]}")
    return rows


def main() -> int:
    found = problems(tuple(sys.argv[1:]) or PACKAGES)
    for row in found:
        print(row)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

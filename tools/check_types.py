# SPDX-License-Identifier: Apache-2.0
"""The strict type check of all Python that ships or measures: mypy without an error, with the
packages and the settings of [tool.mypy] in pyproject.toml.

python -m tools.check_types [PACKAGE …]      prints mypy's rows; exit code 1 when there is any
"""

import subprocess
import sys
from collections.abc import Sequence

from tools import ROOT, exit_code


def problems(packages: Sequence[str] = ()) -> list[str]:
    """The errors that mypy reports, one row each; without packages, those of pyproject.toml."""
    command = [sys.executable, "-m", "mypy", "--no-error-summary"]
    for package in packages:
        command += ["-p", package]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    rows = [row for row in done.stdout.splitlines() if ": error:" in row]
    if done.returncode and not rows:
        raise RuntimeError(f"mypy failed: {(done.stderr or done.stdout).strip()[-300:]}")
    return rows


def main() -> int:
    return exit_code(problems(sys.argv[1:]))


if __name__ == "__main__":
    sys.exit(main())

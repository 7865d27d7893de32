# SPDX-License-Identifier: Apache-2.0
"""Figures of what the project promises about itself: documentation, words, imports, types, time.

The checks are those of tools/, which `make promises` runs too.
"""

import subprocess
import tempfile
import time
from pathlib import Path

from figures.common import Figure, Quick, bar, console
from tools import check_imports, check_latency, check_ports, check_types, docs_commands
from twin.build import ROOT


def listed(problems: list[str]) -> int:
    """How many there are; each is printed."""
    for row in problems:
        console.print(row, markup=False, highlight=False)
    return len(problems)


def docs_commands_failed(whole: bool = True, only: str = "") -> int:
    """Command lines that do not do what is printed, of one page or of all."""
    pages = [page for page in docs_commands.pages() if only in ("", page.path.name)]
    found: list[str] = []
    with bar("pages") as progress:
        for page in progress.track(pages):
            found += docs_commands.failures(page, whole)
    return listed(found)


def check_minutes(command: tuple[str, ...] = ("make", "check")) -> float:
    """Minutes of a command in a fresh clone, set-up included; infinite if it fails."""
    with tempfile.TemporaryDirectory(prefix="moire-check-") as folder:
        clone = Path(folder) / "moire"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
        shared = ROOT.parent / "shared"
        if shared.is_dir():
            (Path(folder) / "shared").symlink_to(shared)
        began = time.monotonic()
        done = subprocess.run(
            command, cwd=clone, stdin=subprocess.DEVNULL, capture_output=True, text=True
        )
        minutes = (time.monotonic() - began) / 60
    if done.returncode:
        console.print((done.stdout + done.stderr)[-2000:], markup=False, highlight=False)
        return float("inf")
    return minutes


FIGURES = {
    "docs_commands_failed": Figure(
        docs_commands_failed,
        "commands",
        "command lines of README, tutorial and docs that do not do what is printed, each run; "
        "those for hardware against the served twin",
        "0",
        Quick({"whole": False, "only": "boards.md"}, "one page"),
        0,
    ),
    "ports_bare": Figure(
        lambda: listed(check_ports.problems()),
        "ports",
        "ports and parameters of the RTL without unit or meaning",
        "0",
        Quick(),
        0,
    ),
    "latency_untested": Figure(
        lambda: listed(check_latency.problems()),
        "claims",
        "latency claims in the headers of the RTL without a test of that name",
        "0",
        Quick(),
        0,
    ),
    "import_cycles": Figure(
        lambda: listed(check_imports.problems()),
        "cycles",
        "cycles among C files and Python modules, imports from tb outside tb, patches of sys.path",
        "0",
        Quick(),
        0,
    ),
    "types_errors": Figure(
        lambda: listed(check_types.problems()),
        "errors",
        "errors of mypy --strict in the Python that ships, measures or makes tables",
        "0",
        Quick(),
        0,
    ),
    "check_minutes": Figure(
        check_minutes,
        "min",
        "make check from a clean clone on 2 cores, set-up included",
        "<= 20",
        Quick({"command": ("make", "-n", "help")}, "a clone only", bound=""),
        1,
    ),
}

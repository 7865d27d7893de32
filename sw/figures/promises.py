# SPDX-License-Identifier: Apache-2.0
"""Figures of what the project promises about itself: words, documentation, imports, types, time."""

import subprocess
import tempfile
import time
from pathlib import Path

from figures.common import bar, console
from tools import docs_commands

ROOT = Path(__file__).resolve().parents[2]


def listed(problems: list[str]) -> int:
    """Their count; each is printed."""
    for row in problems:
        console.print(row, markup=False, highlight=False)
    return len(problems)


def docs_commands_failed(whole: bool = True) -> int:
    """Command lines of README and docs that do not do what is printed."""
    found: list[str] = []
    with bar("pages") as progress:
        for page in progress.track(docs_commands.pages()):
            found += docs_commands.failures(page, whole)
    return listed(found)


def check_minutes() -> float:
    """Minutes of `make check` in a fresh clone, set-up included."""
    with tempfile.TemporaryDirectory(prefix="moire-check-") as folder:
        clone = Path(folder) / "moire"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
        shared = ROOT.parent / "shared"
        if shared.is_dir():
            (Path(folder) / "shared").symlink_to(shared)
        began = time.monotonic()
        done = subprocess.run(["make", "check"], cwd=clone, stdin=subprocess.DEVNULL)
        minutes = (time.monotonic() - began) / 60
        if done.returncode:
            console.print(f"make check failed after {minutes:.1f} minutes")
            return float("inf")
    return minutes

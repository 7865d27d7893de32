# SPDX-License-Identifier: Apache-2.0
"""Checks and helpers of the project; run them as `python -m tools.NAME`."""

import signal
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def exit_code(problems: Iterable[str]) -> int:
    """Prints the problems that a check has found, one per line; returns 1 if there are any."""
    rows = list(problems)
    for row in rows:
        print(row)
    return 1 if rows else 0


def obey_signals() -> None:
    """In a new process: a shell lets its background jobs ignore Ctrl-C, and nohup SIGHUP, which
    they inherit.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)

# SPDX-License-Identifier: Apache-2.0
"""Campaigns whose parts do nothing but leave a trace in a folder, and what goes wrong in them."""

import os
import signal
from functools import partial
from pathlib import Path

from campaigns.campaign import Campaign

TRIED = 10  # of a part


def runs(folder):
    """Numbers of the parts that have been begun, in their order."""
    path = Path(folder) / "begun"
    return [int(line) for line in path.read_text().splitlines()] if path.exists() else []


def noted(folder, part):
    with open(Path(folder) / "begun", "a", encoding="utf-8") as file:
        file.write(f"{part}\n")


def calm(folder, part, seed):
    noted(folder, part)
    return {"trials": TRIED, "wrong": 0, "seeds": seed, "largest seed": seed}


def kills(folder, part, seed, at=2, victim="worker", always=False):
    """Part `at` kills its worker, or the process whose number is in the file `victim`; once, or
    whenever it runs.
    """
    counts = calm(folder, part, seed)
    again = Path(folder) / "killed"
    if part == at and (always or not again.exists()):
        again.touch()
        file = Path(folder) / victim
        os.kill(int(file.read_text()) if file.exists() else os.getpid(), signal.SIGKILL)
    return counts


def wrong(folder, part, seed):
    """Part 1 has failures and says what; part 3 fails itself."""
    counts = calm(folder, part, seed)
    if part == 3:
        raise ZeroDivisionError(f"no result for the seed {seed}")
    return {**counts, "wrong": 2, "input": f"bytes of {seed}"} if part == 1 else counts


def campaign(folder, run=calm, parts=5, **more):
    return Campaign(
        "trials; failed: wrong ones",
        partial(run, str(folder), **more),
        parts,
        "trials",
        "wrong",
        ("largest seed",),
    )

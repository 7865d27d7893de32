# SPDX-License-Identifier: Apache-2.0
"""Threads that LinuxCNC cuts on the simulated lathe: how the true path of its table follows the
true angle of its spindle.
"""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy

from linuxcnc_config.headless import run
from linuxcnc_config.programs import PASSES, THREAD_MM, THREADS, grooves_of, thread_errors
from linuxcnc_config.twin_machine import (
    LATHE,
    PARTS,
    PERIOD_S,
    SPINDLE_TURNS_S,
    TwinMachine,
    running,
)
from moire.errors import MoireError

CUTS = {"thread": 1, "passes": PASSES}  # of each of THREADS


def cut(names: Sequence[str] = tuple(THREADS), seed: int = 1) -> tuple[float, float]:
    """In mm: the largest pitch error, that is the range within a pass of the way of the table less
    that of the spindle, and the largest distance of a pass from the groove of the first one.
    MoireError if LinuxCNC does not come to the end or a pass is missing.
    """
    texts = {f"{name}.ngc": THREADS[name](SPINDLE_TURNS_S) for name in names}
    with tempfile.TemporaryDirectory() as folder, TwinMachine(LATHE, seed) as served:
        ran = run(served.configuration(), Path(folder), running(names), texts)
        z, turns = served.true_path()[:, 2], numpy.array(served.turns)
    ran.finished()
    grooves = grooves_of(turns, z, THREAD_MM, SPINDLE_TURNS_S, PERIOD_S / PARTS)
    if len(grooves) != sum(CUTS[name] for name in names):
        raise MoireError(f"{len(grooves)} passes of {', '.join(names)}")
    within, apart = thread_errors(grooves)
    return THREAD_MM * within, THREAD_MM * apart

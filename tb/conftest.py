# SPDX-License-Identifier: Apache-2.0
"""The seed is decided here once, before any worker of pytest-xdist starts; and twins are built for
short runs.
"""

import os

from tb.bench import seed
from twin.build import SHORT_RUNS

os.environ[SHORT_RUNS] = "1"
DRAWN = os.environ.get("SEED") == "random"
SEED = seed()


def pytest_terminal_summary(terminalreporter):
    if DRAWN:
        terminalreporter.write_line(f"SEED=random drew {SEED}. The same run again: SEED={SEED}")

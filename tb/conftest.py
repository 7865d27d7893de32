# SPDX-License-Identifier: Apache-2.0
"""The seed is decided here once, before any worker of pytest-xdist starts; and twins are built for
short runs. Files that take long come first, so that none of them is left to one worker at the end.
"""

import inspect
import os
import re

from tb.bench import seed
from twin.build import SHORT_RUNS

os.environ[SHORT_RUNS] = "1"
DRAWN = os.environ.get("SEED") == "random"
SEED = seed()


SIMULATES = re.compile(
    r"\brun\([^()]*(\([^()]*\))?[^()]*__file__"
)  # a test of a block has a netlist
LONG = ("docs", "system", "control", "twin", "peripheral")  # folders, from the longest on


def pytest_collection_modifyitems(config, items):
    order = {name: n for n, name in enumerate(LONG)}
    items.sort(key=lambda item: order.get(item.path.parent.name, len(LONG)))
    if os.environ.get("NETLIST"):
        blocks = [item for item in items if SIMULATES.search(inspect.getsource(item.function))]
        config.hook.pytest_deselected(items=[item for item in items if item not in blocks])
        items[:] = blocks


def pytest_terminal_summary(terminalreporter):
    if DRAWN:
        terminalreporter.write_line(f"SEED=random drew {SEED}. The same run again: SEED={SEED}")

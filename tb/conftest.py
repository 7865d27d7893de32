# SPDX-License-Identifier: Apache-2.0
"""The seed is decided here once, before any worker of pytest-xdist starts; and twins are built for
short runs. Files that take long come first, so that none of them is left to one worker at the end.
"""

import inspect
import os
import re

from tb.bench import seed
from twin.build import ROOT, SHORT_RUNS
from twin.netlist import NODE_TESTS

os.environ[SHORT_RUNS] = "1"
DRAWN = os.environ.get("SEED") == "random"
SEED = seed()


SIMULATES = re.compile(
    r"\brun\([^()]*(\([^()]*\))?[^()]*__file__"
)  # a test of a block has a netlist
LONG = ("docs", "system", "control", "twin", "peripheral", "netlist")  # folders, the longest first


def of_block(item):
    """Whether a test simulates a block by tb.bench.run."""
    return bool(SIMULATES.search(inspect.getsource(item.function)))


def on_node(item):
    """Whether a test runs the twin of a node, in a random state or on the netlist: the ECP5's."""
    chosen = os.environ.get("POWER_UP") or os.environ.get("NETLIST") == "ecp5"
    return bool(chosen) and item.path.relative_to(ROOT).as_posix() in NODE_TESTS


def pytest_collection_modifyitems(config, items):
    order = {name: n for n, name in enumerate(LONG)}
    items.sort(key=lambda item: order.get(item.path.parent.name, len(LONG)))
    if any(os.environ.get(name) for name in ("NETLIST", "POWER_UP", "RTL_COVERAGE")):
        blocks = [item for item in items if of_block(item) or on_node(item)]
        config.hook.pytest_deselected(items=[item for item in items if item not in blocks])
        items[:] = blocks


def pytest_terminal_summary(terminalreporter):
    if DRAWN:
        terminalreporter.write_line(f"SEED=random drew {SEED}. The same run again: SEED={SEED}")

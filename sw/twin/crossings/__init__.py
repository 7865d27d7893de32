# SPDX-License-Identifier: Apache-2.0
"""Simulations in which each change of an asynchronous input may arrive one cycle later, by chance.

With CROSSINGS=seed in the environment, the synchroniser of this directory takes the place of that
of rtl/common in every simulation: it is found first. It is no part of rtl/, so no synthesis can
find it.
"""

import os
from pathlib import Path

HERE = Path(__file__).resolve().parent


def seed() -> int:
    """The seed of the environment; 0: without it, the synchroniser is that of the RTL."""
    return int(os.environ.get("CROSSINGS") or 0)


def folders() -> list[Path]:
    """The folders in which a module is to be looked for before those of rtl/."""
    if not seed():
        return []
    if os.environ.get("NETLIST"):
        raise ValueError(
            "CROSSINGS and NETLIST exclude each other: a netlist has its synchronisers"
        )
    return [HERE]


def plusargs() -> list[str]:
    """The arguments with which a simulator hands the seed to the synchronisers."""
    return [f"+crossings={seed()}"] if seed() else []

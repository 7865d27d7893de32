# SPDX-License-Identifier: Apache-2.0
"""Analogue front ends as parameters of the stage: the results that `make spice` wrote."""

import tomllib
from pathlib import Path
from typing import Any

from twin.parameters.tables import values

FOLDER = Path(__file__).with_name("front_ends")


def names() -> list[str]:
    """The front ends that have a result."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str) -> dict[str, Any]:
    """The result of a front end; KeyError names those that there are."""
    if name not in names():
        raise KeyError(f"there is no result of a front end {name}; there are {', '.join(names())}")
    return tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))


def front_end(name: str) -> dict[str, float]:
    """{parameter of the stage: value} of a stage whose signals go through a front end. Errors of
    the front end add to those of the read head; noise is in LSB of the stage's converter word.
    """
    found, stage = load(name), values()
    return {
        "signal_amplitude": found["amplitude"],
        "signal_offset_sin": stage["signal_offset_sin"] + found["offset"],
        "signal_gain_cos": stage["signal_gain_cos"] * (1 + found["gain_mismatch"]),
        "signal_noise": found["noise"] * 2.0 ** (stage["signal_bits"] - found["bits"]),
        "signal_bandwidth": found["bandwidth"],
        "signal_skew": found["skew"],
    }

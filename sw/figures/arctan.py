# SPDX-License-Identifier: Apache-2.0
"""Figures of the pipelined arctan: how exact it is over every sample there is, and how fast and
large it becomes.
"""

from functools import cache
from pathlib import Path

from figures.common import Figure, Quick, console
from figures.synthesis import ELABORATED, elaborated, source_of, synthesise
from twin.build import ROOT, run, simulation

ARCTAN = ROOT / "rtl" / "interpolate" / "arctan_pipelined.sv"
SWEEP = Path(__file__).with_name("arctan_sweep.cpp")
SEED = 1  # of the placement; not picked, others are within 5 % of it


def worst(w: int, least: float) -> float:
    """LSB, over every sample whose radius is at least this share of full scale."""
    printed = run([simulation(SWEEP, ARCTAN, W=w), w, least], "arctan sweep").split()
    pairs, lsb, wrong, counts = printed
    console.print(
        f"{pairs} samples of {w} bits: {wrong} not correctly rounded, "
        f"amplitude within {counts} counts"
    )
    return float(lsb)


@cache
def placed(seed: int) -> dict[str, float]:
    """W = 12, no block RAM and no multiplier; LUTs as nextpnr counts them, with carry chains and
    their ends.
    """
    return synthesise("arctan_pipelined", {"W": 12}, target_mhz=200, seed=seed)


def on_ecp5(name: str, place: bool, seed: int) -> float:
    return placed(seed)[name] if place else elaborated(source_of("arctan_pipelined"), {"W": 12})


def arctan_lsb_8bit() -> float:
    return worst(8, 0)


def arctan_lsb_12bit(bits: int = 12, least: float = 0.25) -> float:
    return worst(bits, least)


def arctan_ecp5_mhz(place: bool = True, seed: int = SEED) -> float:
    return on_ecp5("fmax_mhz", place, seed)


def arctan_ecp5_lut(place: bool = True, seed: int = SEED) -> float:
    return on_ecp5("lut", place, seed)


FIGURES = {
    "arctan_lsb_8bit": Figure(
        arctan_lsb_8bit,
        "LSB",
        "largest error of the pipelined arctan (RTL), in LSB of 16 bits, over all 65 535 non-zero "
        "8-bit samples",
        "<= 0.5",
        Quick(),
        4,
        "correctly rounded",
    ),
    "arctan_lsb_12bit": Figure(
        arctan_lsb_12bit,
        "LSB",
        "the same over all 12-bit samples with a radius of 25 % of full scale or more",
        "<= 0.51",
        Quick({"bits": 9}, "all 9-bit samples of that radius"),
        4,
    ),
    "arctan_ecp5_mhz": Figure(
        arctan_ecp5_mhz,
        "MHz",
        "highest clock of the pipelined arctan alone (W 12, STEPS 1, in no product; the node has "
        "arctan_quotient), one sample per cycle, LFE5U-25F-6, placement seed 1",
        ">= 190",
        ELABORATED,
        1,
    ),
    "arctan_ecp5_lut": Figure(
        arctan_ecp5_lut,
        "LUT",
        "LUTs of the same, no block RAM, no multiplier",
        "< 1189",
        ELABORATED,
        0,
        "Bedrock cordicg 1189",
    ),
}

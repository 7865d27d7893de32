# SPDX-License-Identifier: Apache-2.0
"""How true the pipelined arctan is over every sample there is, and how fast and large it becomes."""

from functools import cache
from pathlib import Path

from figures.common import Figure, console
from figures.synthesis import synthesise
from twin.build import run, simulation

ARCTAN = Path(__file__).resolve().parents[2] / "rtl" / "interpolate" / "arctan_pipelined.sv"
SWEEP = Path(__file__).with_name("arctan_sweep.cpp")
SEED = 1  # of the placement; not picked, others lie within 5 % of it


def worst(w, part):
    """LSB, over every sample whose radius is at least this part of full scale."""
    pairs, lsb, wrong, counts = run(
        [simulation(SWEEP, ARCTAN, W=w), w, part], "arctan sweep"
    ).split()
    console.print(
        f"{pairs} samples of {w} bits: {wrong} not correctly rounded, amplitude within {counts} counts"
    )
    return float(lsb)


@cache
def placed():
    """W = 12, no block RAM and no multiplier in it; LUT as nextpnr counts them, carry chains and
    their ends included.
    """
    return synthesise("arctan_pipelined", {"W": 12}, wanted_mhz=200, seed=SEED)


def arctan_lsb_8bit():
    return worst(8, 0)


def arctan_lsb_12bit():
    return worst(12, 0.25)


def arctan_ecp5_mhz():
    return placed()["fmax_mhz"]


def arctan_ecp5_lut():
    return placed()["lut"]


FIGURES = {
    "arctan_lsb_8bit": Figure(
        arctan_lsb_8bit,
        "LSB",
        "largest error of the pipelined arctan, in LSB of 16 bit, over all 65 535 non-zero "
        "8-bit samples, RTL",
        "<= 0.500 (correctly rounded)",
        lambda v: v <= 0.5,
        4,
    ),
    "arctan_lsb_12bit": Figure(
        arctan_lsb_12bit,
        "LSB",
        "the same over all 12-bit samples with a radius of 25 % of full scale or more, "
        "every one tried",
        "<= 0.51",
        lambda v: v <= 0.51,
        4,
    ),
    "arctan_ecp5_mhz": Figure(
        arctan_ecp5_mhz,
        "MHz",
        "pipelined arctan alone, 12 bits, one sample a clk, LFE5U-25F-6",
        ">= 190",
        lambda v: v >= 190,
        1,
    ),
    "arctan_ecp5_lut": Figure(
        arctan_ecp5_lut,
        "LUT",
        "the same: LUTs, no block RAM, no multiplier",
        "< 1189",
        lambda v: v < 1189,
        0,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of the chain from ADC word to corrected position: how long it takes, and how fast and
large it is.
"""

from pathlib import Path

from figures.common import Figure, Quick, console
from figures.synthesis import (
    ECP5,
    ECP5_CELLS,
    ELABORATED,
    NEXTPNR_ECP5,
    elaborated,
    mhz_words,
    netlist_of,
    placements,
)
from twin.build import ROOT, run, simulation

HERE = Path(__file__).resolve().parent
CHANNEL = ROOT / "rtl" / "feedback_channel.sv"
DRIVER = HERE / "interpolate_latency.cpp"
BENCH = HERE / "interpolator_bench.sv"
SEED = 1  # of the first placement
W = 8  # bits of S0's ADC
LEADING = 2  # bits that it sends before them


def interpolate_latency_clk() -> float:
    """One word is sent through rtl/feedback_channel.sv, of which only the ports are read."""
    program = simulation(DRIVER, CHANNEL, W=W)
    return float(run([program, W, LEADING], "latency of the feedback channel"))


def interpolate_ecp5_mhz(place: bool = True, seed: int = SEED) -> float:
    """Every input of the bench is a register, and every output too: no path is left out."""
    if not place:
        return elaborated(BENCH, {"W": W})
    netlist = netlist_of(BENCH, {"W": W}, "ecp5", 1)
    alone = "--lpf-allow-unconstrained", "--out-of-context"
    tries = placements(netlist, NEXTPNR_ECP5, ECP5, 110, seed, *alone)
    used = tries[0][1]
    console.print(
        "filter, correction, arctan, harmonics, tracker, position: "
        + ", ".join(
            f"{used[cell]['used']} {name.replace('_', ' ')}" for name, cell in ECP5_CELLS.items()
        )
        + f"; {mhz_words(tries)}"
    )
    return min(mhz for mhz, _ in tries)


FIGURES = {
    "interpolate_latency_clk": Figure(
        interpolate_latency_clk,
        "cycles",
        "ADC word to corrected position, one word sent through the feedback channel of the node",
        "<= 25",
        Quick(),
        0,
    ),
    "interpolate_ecp5_mhz": Figure(
        interpolate_ecp5_mhz,
        "MHz",
        "highest clock of the whole chain from ADC word to corrected position, one sample per "
        "cycle, LFE5U-25F-6, the worst of three placements",
        ">= 100",
        ELABORATED,
        1,
    ),
}

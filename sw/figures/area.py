# SPDX-License-Identifier: Apache-2.0
"""Figures of area: what an axis and what a node cost on the chip, and how fast the node runs.

A cell of LUT RAM (TRELLIS_DPR16X4) counts as the six LUT4 that it takes on an ECP5, a carry cell
(CCU2C) as two. The figures of an axis map to LUT4 alone (synth_ecp5 -nowidelut), which makes a
netlist of fewer LUT4 and a slower one; those of whole nodes, which are placed, use the wide LUT.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from boards import board
from boards.family import Part
from figures.common import Figure, console
from figures.synthesis import (
    ECP5,
    ECP5_CELLS,
    ELABORATED,
    NEXTPNR_ECP5,
    NEXTPNR_ICE40,
    UP5K,
    elaborated,
    lut4s,
    mhz_words,
    netlist_of,
    placements,
    source_of,
)
from firmware import build as firmware_build
from twin import build

Parameters = Mapping[str, int | str]

TARGET_MHZ = 66
ALL_AXES = 255
BEFORE = 2  # axes of the node that gets another one
LUT_OF = 24288  # of an LFE5U-25F
SMALL = "-nowidelut"  # every LUT counts alone; with the wide ones Yosys takes more LUT4 (2 to 5 %)

# A/B/Z, step and direction, homing, profile, servo, interlock
STEP_AXES: Parameters = {
    "CLK_HZ": 60_000_000,
    "FILTERS": 0,
    "HAS_SINE": 0,
    "HAS_CAPTURE": 0,
    "HAS_COMPARE": 0,
    "HAS_ENCODER_CHECK": 0,
    "HAS_BRIDGE": 0,
    "HAS_STEPPER": ALL_AXES,
    "HAS_DAC": 0,
    "MEMORY_BYTES": 65536,  # of the image `steps`
}
# sine and cosine with correction and harmonics, PWM and DAC
SINE_AXES: Parameters = {
    **STEP_AXES,
    "HAS_SINE": ALL_AXES,
    "HAS_MONITOR": 0,
    "HAS_HARMONICS": ALL_AXES,
    "HAS_RECORDER": 0,
    "HAS_BRIDGE": ALL_AXES,
    "HAS_STEPPER": 0,
    "HAS_DAC": ALL_AXES,
    "HAS_FINE_STAGE": 0,
    "MEMORY_BYTES": firmware_build.MEMORY_BYTES,  # of the image `axis`
}
S0_NODE: Parameters = {
    "CLK_HZ": 60_000_000,
    "HAS_STEPPER": 0,
    "FIRMWARE": "build/firmware/firmware.hex",
}
# a node that counts A/B/Z with index, filters and captures; its firmware is in the SPRAM
COUNTER_BOX = Path(__file__).with_name("counter_box_bench.sv")
OF_BOTH: dict[str, Parameters] = {
    "compare": {"HAS_COMPARE": ALL_AXES},
    "capture queue": {"HAS_CAPTURE": ALL_AXES},
    "check of the encoder": {"HAS_ENCODER_CHECK": ALL_AXES},
    "segment table of 255": {"SEGMENTS": 255},
    "two biquads": {"FILTERS": 2},
}
OF_STEP_AXES: dict[str, Parameters] = {
    **OF_BOTH,
    "bridge": {"HAS_BRIDGE": ALL_AXES},
    "set-points": {"HAS_SET_POINTS": ALL_AXES},
    "compensation of backlash": {"HAS_BACKLASH": ALL_AXES},
    "real-time link": {"HAS_LINK": 1},
    "execution from a flash": {"CODE_BYTES": firmware_build.CODE_BYTES},
}
OF_SINE_AXES: dict[str, Parameters] = {
    **OF_BOTH,
    "signal monitor": {"HAS_MONITOR": ALL_AXES},
    "recorder": {"HAS_RECORDER": ALL_AXES},
    "fine stage": {"HAS_FINE_STAGE": ALL_AXES},
    "step generator": {"HAS_STEPPER": ALL_AXES},
}


@cache
def node_lut(parameters: tuple[tuple[str, int | str], ...]) -> int:
    """LUT4 of a node on an ECP5."""
    return lut4s(netlist_of(source_of("node"), dict(parameters), "ecp5", 1, SMALL), "node")


def lut_of(parameters: Parameters, axes: int) -> int:
    return node_lut(tuple({**parameters, "AXES": axes}.items()))


def axis_lut(parameters: Parameters, features: Mapping[str, Parameters], place: bool) -> float:
    """What a node with one axis more takes more, and a table of what each feature adds to it."""
    if not place:
        return elaborated(source_of("node"), {**parameters, "AXES": BEFORE})
    more = lut_of(parameters, BEFORE + 1) - lut_of(parameters, BEFORE)
    console.print(f"node of {BEFORE} axes: {lut_of(parameters, BEFORE)} LUT4; one more: {more}")
    for name, parameter in features.items():
        added = lut_of({**parameters, **parameter}, 1) - lut_of(parameters, 1)
        console.print(f"  {name} adds {added} to a node of one axis")
    return float(more)


def axis_step_lut(place: bool = True) -> float:
    return axis_lut(STEP_AXES, OF_STEP_AXES, place)


def axis_sine_lut(place: bool = True) -> float:
    return axis_lut(SINE_AXES, OF_SINE_AXES, place)


@cache
def on_ecp5(parameters: tuple[tuple[str, int | str], ...], seed: int) -> dict[str, float]:
    """{lut, fmax_mhz} of a node on an LFE5U-25F-6, the worst of some placements."""
    netlist = netlist_of(source_of("node"), dict(parameters), "ecp5", 1)
    more = ("--lpf-allow-unconstrained", "--out-of-context")
    tries = placements(netlist, NEXTPNR_ECP5, ECP5, TARGET_MHZ, seed, *more)
    used = tries[0][1]
    words = ", ".join(
        f"{used[cell]['used']} of {used[cell]['available']} {name.replace('_', ' ')}"
        for name, cell in ECP5_CELLS.items()
    )
    console.print(f"{words}; {mhz_words(tries)}")
    return {"lut": used[ECP5_CELLS["lut"]]["used"], "fmax_mhz": min(mhz for mhz, _ in tries)}


def node_on_ecp5(name: str, parameters: Parameters, place: bool, seed: int) -> float:
    if not place:
        return elaborated(source_of("node"), parameters)
    found = on_ecp5(tuple(parameters.items()), seed)
    console.print(f"{100 * found['lut'] / LUT_OF:.0f} % of the LUT")
    return found[name]


def node8_step_ecp5_mhz(place: bool = True, seed: int = 1) -> float:
    return node_on_ecp5("fmax_mhz", {**STEP_AXES, "AXES": 8}, place, seed)


def node4_sine_ecp5_mhz(place: bool = True, seed: int = 1) -> float:
    return node_on_ecp5("fmax_mhz", {**SINE_AXES, "AXES": 4}, place, seed)


def node_ecp5_mhz(place: bool = True, seed: int = 1) -> float:
    build.firmware()
    return node_on_ecp5("fmax_mhz", S0_NODE, place, seed)


def node_ecp5_lut(place: bool = True, seed: int = 1) -> float:
    build.firmware()
    return node_on_ecp5("lut", S0_NODE, place, seed)


@cache
def up5k() -> Part:
    """The part of the iCEBreaker, with the options of synthesis and placement that fit a node."""
    return board.named("icebreaker").part


def counter_box() -> Path:
    """The netlist of the node that counts."""
    return netlist_of(COUNTER_BOX, {}, "ice40", 1, up5k().synthesis)


@cache
def on_up5k(seed: int) -> dict[str, float]:
    """{lc, fmax_mhz} of the node that counts, the worst of some placements."""
    options = ["--pcf-allow-unconstrained", *up5k().place]
    tries = placements(counter_box(), NEXTPNR_ICE40, UP5K, 20, seed, *options)
    used = tries[0][1]
    names = ("ICESTORM_LC", "ICESTORM_RAM", "ICESTORM_SPRAM", "ICESTORM_DSP")
    words = ", ".join(f"{used[one]['used']} of {used[one]['available']} {one}" for one in names)
    console.print(f"{words}; {mhz_words(tries)}")
    return {"lc": used["ICESTORM_LC"]["used"], "fmax_mhz": min(mhz for mhz, _ in tries)}


def node_on_up5k(name: str, place: bool, seed: int) -> float:
    return on_up5k(seed)[name] if place else elaborated(COUNTER_BOX)


def node_up5k_lc(place: bool = True, seed: int = 1) -> float:
    return node_on_up5k("lc", place, seed)


def node_up5k_mhz(place: bool = True, seed: int = 1) -> float:
    return node_on_up5k("fmax_mhz", place, seed)


STEP_WORDS = "A/B/Z, step and direction, homing, profile, servo and interlock"
SINE_WORDS = "sine and cosine with correction and harmonics, PWM and DAC"
COUNTING_WORDS = (
    "node that counts (4 axes of A/B/Z with index, filters, captures, bus; no drives), firmware in "
    "the SPRAM, on an iCE40 UP5K"
)
FIGURES = {
    "axis_step_lut": Figure(
        axis_step_lut,
        "LUT4",
        f"what each further axis adds to a node: {STEP_WORDS}; mapped to LUT4 alone, two for a "
        "carry cell, six for a cell of LUT RAM",
        "<= 1200",
        ELABORATED,
        0,
    ),
    "axis_sine_lut": Figure(
        axis_sine_lut,
        "LUT4",
        f"what each further axis adds to a node: {SINE_WORDS}; counted likewise",
        "<= 3000",
        ELABORATED,
        0,
    ),
    "node8_step_ecp5_mhz": Figure(
        node8_step_ecp5_mhz,
        "MHz",
        f"highest clock of a node of 8 axes with {STEP_WORDS}, placed and routed for an "
        "LFE5U-25F-6, the worst of three placements",
        ">= 66",
        ELABORATED,
        1,
    ),
    "node4_sine_ecp5_mhz": Figure(
        node4_sine_ecp5_mhz,
        "MHz",
        f"highest clock of a node of 4 axes with {SINE_WORDS}, placed and routed for an "
        "LFE5U-25F-6, the worst of three placements",
        ">= 66",
        ELABORATED,
        1,
    ),
    "node_ecp5_mhz": Figure(
        node_ecp5_mhz,
        "MHz",
        "highest clock of the S0 node with bridge, ADC, fine stage and filters, placed and routed "
        "for an LFE5U-25F-6, the worst of three placements",
        ">= 70",
        ELABORATED,
        1,
    ),
    "node_ecp5_lut": Figure(
        node_ecp5_lut,
        "LUT",
        "size of that node",
        "<= 12000",
        ELABORATED,
        0,
    ),
    "node_up5k_lc": Figure(
        node_up5k_lc,
        "LC",
        f"size of a {COUNTING_WORDS}",
        "<= 5280",
        ELABORATED,
        0,
    ),
    "node_up5k_mhz": Figure(
        node_up5k_mhz,
        "MHz",
        "highest clock of that node, the worst of three placements",
        ">= 20",
        ELABORATED,
        1,
    ),
}

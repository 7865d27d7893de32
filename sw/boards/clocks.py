# SPDX-License-Identifier: Apache-2.0
"""Settings of the PLL between the oscillator of a board and the clock of its node."""

from collections.abc import Callable
from dataclasses import dataclass, field

from boards.toml_file import Misfit

# ECP5 (FPGA-DS-02012), iCE40 UltraPlus (FPGA-DS-02008) and iCE40 HX (FPGA-DS-02029): Hz of the
# oscillator of the PLL
ECP5_VCO = 400_000_000, 800_000_000
ECP5_DETECTOR = 10_000_000, 400_000_000  # at its phase detector
ECP5_OUTPUT = 3_125_000, 400_000_000
ICE40_VCO = 533_000_000, 1_066_000_000
XC7_VCO = 800_000_000, 1_600_000_000  # PLLE2 of a 7-series part (DS181), grades 1 and 1L
XC7_DETECTOR = 19_000_000, 450_000_000
XC7_TARGET = 1_000_000_000
ECP5_MOST = 128  # largest divider
ECP5_TARGET = 600_000_000  # the middle of the range
# Charge pump and loop filter of an EHXPLLL, as ecppll of Project Trellis sets them for any dividers
ECP5_ANALOG = {
    "ICP_CURRENT": 12,
    "LPF_RESISTOR": 8,
    "MFG_ENABLE_FILTEROPAMP": 1,
    "MFG_GMCREF_SEL": 2,
}
ICE40_FILTER = ((17, 1), (26, 2), (44, 3), (66, 4), (101, 5), (134, 6))  # MHz below, setting


@dataclass(frozen=True)
class Pll:
    """What the PLL of a board is set to."""

    settings: dict[str, int]  # dividers, by the names of the primitive's parameters
    output_hz: float
    analog: dict[str, int] = field(default_factory=dict)  # by their names in a placed design


def ecp5(input_hz: int, output_hz: int) -> list[Pll]:
    """What an EHXPLLL with its output as feedback can make, the best first."""
    found = []
    if not ECP5_OUTPUT[0] <= output_hz <= ECP5_OUTPUT[1]:
        return []
    for divide in range(1, ECP5_MOST + 1):
        feedback, left = divmod(output_hz * divide, input_hz)
        if left or not 1 <= feedback <= ECP5_MOST:
            continue
        if not ECP5_DETECTOR[0] <= input_hz / divide <= ECP5_DETECTOR[1]:
            continue
        for output in range(1, ECP5_MOST + 1):
            vco = output_hz * output
            if ECP5_VCO[0] <= vco <= ECP5_VCO[1]:
                settings = {"CLKI_DIV": divide, "CLKFB_DIV": feedback, "CLKOP_DIV": output}
                made = Pll(settings, output_hz, ECP5_ANALOG)
                found.append((divide, abs(vco - ECP5_TARGET), made))
    return [pll for *_, pll in sorted(found, key=lambda each: each[:2])]


def ice40(input_hz: int, output_hz: int) -> list[Pll]:
    """What an SB_PLL40_PAD with simple feedback can make nearest to a clock, the best first."""
    found = []
    for divide in range(16):
        detector = input_hz / (divide + 1)
        setting = next((n for below, n in ICE40_FILTER if detector < below * 1e6), 0)
        if detector < 10e6 or not setting:
            continue
        for shift in range(1, 7):
            for feedback in range(128):
                vco = detector * (feedback + 1)
                if ICE40_VCO[0] <= vco <= ICE40_VCO[1]:
                    settings = {"DIVR": divide, "DIVF": feedback, "DIVQ": shift}
                    made = vco / 2**shift
                    settings["FILTER_RANGE"] = setting
                    found.append((abs(made - output_hz), divide, Pll(settings, made)))
    return [pll for *_, pll in sorted(found, key=lambda each: each[:2])]


def xc7(input_hz: int, output_hz: int) -> list[Pll]:
    """What a PLLE2_BASE can make, the best first."""
    found = []
    for divide in range(1, 57):
        if not XC7_DETECTOR[0] <= input_hz / divide <= XC7_DETECTOR[1]:
            continue
        for output in range(1, 129):
            multiply, left = divmod(output_hz * output * divide, input_hz)
            vco = output_hz * output
            if not left and 2 <= multiply <= 64 and XC7_VCO[0] <= vco <= XC7_VCO[1]:
                settings = {"DIVCLK_DIVIDE": divide, "CLKFBOUT_MULT": multiply}
                settings["CLKOUT0_DIVIDE"] = output
                found.append((divide, abs(vco - XC7_TARGET), Pll(settings, output_hz)))
    return [pll for *_, pll in sorted(found, key=lambda each: each[:2])]


def none(_input_hz: int, _output_hz: int) -> list[Pll]:
    """Of a family whose PLL is not used: the node runs at the clock of the board."""
    return []


def pll(
    makes: Callable[[int, int], list[Pll]], input_hz: int, output_hz: int, file: str
) -> Pll | None:
    """The PLL of a board, out of what its family makes; None if the node runs at the clock of the
    board. It is exact, since the node derives all its times from its clock.
    """
    if input_hz == output_hz:
        return None
    best = makes(input_hz, output_hz)
    if not best or best[0].output_hz != output_hz:
        nearest = f"; the nearest is {best[0].output_hz:.0f} Hz" if best else ""
        raise Misfit(f"{file}: [clock] the PLL makes no {output_hz} Hz of {input_hz} Hz{nearest}")
    return best[0]

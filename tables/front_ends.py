# SPDX-License-Identifier: Apache-2.0
"""Makes the tables of docs/front_ends.md from constraints/front_ends and the results of ngspice."""

import sys
from pathlib import Path
from typing import Any

from boards import front_ends, spice
from boards.front_ends import FrontEnd
from tables import made_files
from tables.boards import link, table
from tables.made_files import ROOT
from twin.parameters import front_ends as results
from twin.parameters.tables import values

PAGE = ROOT / "docs" / "front_ends.md"
BEGIN = "<!-- Made by tables/front_ends.py from constraints/front_ends: do not edit. -->\n"
END = "<!-- End of the made tables. -->\n"


def described(one: FrontEnd) -> list[str]:
    """A front end: purpose, signals, parts table, sources."""
    rows = [
        [
            part.ref,
            part.part,
            part.shown + (f" ± {part.tolerance_pct:g} %" if part.tolerance_pct else ""),
            " to ".join(f"`{net}`" for net in part.nets),
            part.why,
        ]
        for part in one.parts
    ]
    levels = " or ".join(f"{volts:g} V" for volts in one.volts)
    groups = ", ".join(f"`{group}`" for group in one.groups)
    sources = one.analogue.sources if one.analogue else []
    return [
        "",
        f"## {one.name}",
        "",
        f"**{one.title}** ([file]({link(one.file)})). {one.purpose}",
        "",
        f"Signals: {groups}, with {levels} at the board; channels: {one.channels}.",
        *table("ref, part, value, nets, why", rows),
        *(["", "Models of the simulation:", ""] * bool(sources)),
        *(f"- {source}" for source in sources),
    ]


def checked(one: FrontEnd, found: dict[str, Any]) -> list[str]:
    """What ngspice found of a front end."""
    if found["state"] != spice.state(one):
        raise ValueError(f"{one.file} has changed since ngspice ran: make spice")
    its = spice.analogue(one)
    signal, bits = its.signal, f"LSB of {found['bits']} bits"
    nominal, highest = f"{signal['nominal_vpp']:g} Vpp", f"{signal['highest_vpp']:g} Vpp"
    most = f"{100 * spice.MOST_OF_BOARDS:g} % of {its.boards} boards (seed {its.seed})"
    khz = f"{signal['highest_hz'] / 1e3:g} kHz"
    low, high = (signal["common_mode"] + side * signal["common_mode_range"] for side in (-1.0, 1.0))
    rows = [
        ["gain of sine and cosine", f"{found['gain']:.4g} and {found['gain_cos']:.4g}"],
        [f"amplitude at {nominal}", f"{100 * found['amplitude']:.3g} % of full scale"],
        [f"amplitude at {highest}", f"{100 * found['highest_amplitude']:.3g} % of full scale"],
        ["bandwidth", f"{found['bandwidth'] / 1e6:.3g} MHz"],
        ["lowest bandwidth of a board", f"{found['bandwidth_lowest'] / 1e6:.3g} MHz"],
        [f"phase lag at {khz}", f"{found['lag_deg']:.3g}°"],
        [f"amplitude lost at {khz}", f"{found['droop_pct']:.2g} %"],
        ["noise of the amplifier and the resistors", f"{found['noise_amplifier']:.2g} {bits} rms"],
        ["noise of the converter", f"{found['noise_converter']:.2g} {bits} rms"],
        [f"gain mismatch that {most} do not exceed", f"{100 * found['gain_mismatch']:.2g} %"],
        ["worst gain mismatch", f"{100 * found['gain_mismatch_worst']:.2g} %"],
        [f"difference of the delays, {most}", f"{1e9 * found['skew']:.2g} ns"],
        [f"offset, {most}", f"{100 * found['offset']:.2g} % of the amplitude"],
        [
            f"largest deviation from a straight line at {highest}, common mode {low:g} to "
            f"{high:g} V",
            f"{found['bending']:.2g} {bits}",
        ],
        [
            "levels at the pins of the converter",
            f"{found['pin_lowest']:.2f} to {found['pin_highest']:.2f} V",
        ],
        [
            "levels at the inputs of the amplifier",
            f"{found['input_lowest']:.2f} to {found['input_highest']:.2f} V",
        ],
    ]
    return ["", f"## What ngspice found of {one.name}", *table("what, value", rows)]


def compared(name: str) -> list[str]:
    """The parameters of the stage with a front end, and without."""
    stage = values()
    rows = [
        [f"`{parameter}`", f"{stage[parameter]:g}", f"{value:.4g}"]
        for parameter, value in results.front_end(name).items()
    ]
    return ["", f"## The twin with {name}", *table("parameter, as it stands, with it", rows)]


def make() -> dict[Path, str]:
    lines: list[str] = []
    for one in map(front_ends.named, front_ends.names()):
        lines += described(one)
    for name in results.names():
        lines += checked(front_ends.named(name), results.load(name))
        lines += compared(name)
    return {PAGE: made_files.filled(PAGE, BEGIN, END, [*lines, ""])}


if __name__ == "__main__":
    sys.exit(made_files.main(__doc__ or "", make))

# SPDX-License-Identifier: Apache-2.0
"""Figures of the real-time link: is a bad packet ever acted upon, and how large is the hardware.

The packets go into the Verilated process_link (link_run.cpp). A packet counts as acted upon when it
causes an access of the register bus or a reply, or when it is not counted as refused exactly once.
"""

from functools import cache
from pathlib import Path

from figures.common import Figure, Quick, bar, console, shares
from figures.synthesis import ELABORATED, elaborated, lut4s, netlist_of, source_of
from moire.errors import MoireError
from twin.build import ROOT, run, simulation

TOP = "process_link"
RTL = ROOT / "rtl" / "link" / f"{TOP}.sv"
DRIVER = Path(__file__).with_name("link_run.cpp")
PACKETS = 10**6
SHARE = 10**5  # of one run, each with a seed of its own


@cache
def program() -> Path:
    return simulation(DRIVER, RTL)


def link_wrong_accepted(count: int = PACKETS, seed: int = 1) -> float:
    tried = wrong = missed = 0
    with bar(f"{count:.0e} packets") as progress:
        task = progress.add_task("", total=count)
        for size, number in shares(count, SHARE, seed):
            found = [int(word) for word in run([program(), size, number], "link_run").split()]
            tried, wrong, missed = tried + found[0], wrong + found[1], missed + found[2]
            progress.advance(task, size)
    console.print(
        f"{tried} bad packets, {wrong} acted upon or not counted; "
        f"of the good ones between them {missed} refused"
    )
    if missed:
        raise MoireError(
            f"{missed} good packets were refused: the count of wrong ones means nothing"
        )
    return wrong


def link_lut(place: bool = True, seed: int = 1) -> float:
    """Without `place`, the word-level cells of the module."""
    if not place:
        return elaborated(source_of(TOP))
    return lut4s(netlist_of(source_of(TOP), {}, "ecp5", seed), TOP)


FIGURES = {
    "link_wrong_accepted": Figure(
        link_wrong_accepted,
        "packets",
        "of 10^6 damaged, foreign, replayed, truncated or hostile packets to the real-time link: "
        "acted upon",
        "0",
        Quick({"count": 2000}, "2000 packets"),
        0,
    ),
    "link_lut": Figure(
        link_lut,
        "LUT4",
        "hardware of the real-time link without its carrier and its registers, from Yosys for the "
        "ECP5",
        "<= 900",
        ELABORATED,
        0,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of the incremental encoder: does it ever count wrong, and how large and how fast is the
counter on an iCE40 HX8K.

The campaign of 10^9 edges is `make soak K=decoder`.
"""

from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign
from figures.common import Figure, Quick, bar, console, seeds, shares
from figures.synthesis import ELABORATED, elaborated, source_of, synthesise_ice40
from twin.build import ROOT, run, simulation

ENCODER = ROOT / "rtl" / "decode" / "incremental_encoder.sv"
DRIVER = Path(__file__).with_name("encoder_run.cpp")
EDGES = 10**7
SHARE = 10**6  # edges of one run, each with a seed of its own
PLACEMENTS = 5  # the figure is the worst of them


def encoder_run(edges: int, seed: int) -> dict[str, int]:
    """What the program counts over so many edges, {name: number}."""
    words = run([simulation(DRIVER, ENCODER), edges, seed], "encoder_run").split()
    return {name: int(value) for value, name in zip(words[::2], words[1::2])}


def decoder_miscounts(edges: int = EDGES, seed: int = 1) -> float:
    """Cycles in which the count differs from a plain model's, over so many edges with jitter,
    glitches below the filter, random reversals and an index every 1000 counts. Each false flag or
    index counts as one more.
    """
    totals: dict[str, int] = {}
    with bar(f"{edges:.0e} edges") as progress:
        task = progress.add_task("", total=edges)
        for size, number in shares(edges, SHARE, seed):
            for name, value in encoder_run(size, number).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["edges"])
    console.print(", ".join(f"{value} {name}" for name, value in totals.items()))
    return float(totals["wrong"])


@cache
def hx8k(seed: int) -> list[dict[str, float]]:
    """encoder_counter, which has the features of HostMot2's counter: settings, flags and both words
    on its bus, a filter of up to 15 samples, index and probe latch, time of the last edge. The rate
    of the samples and the time itself come from outside.
    """
    found = [synthesise_ice40("encoder_counter", seed=one) for one in seeds(seed, PLACEMENTS)]
    console.print(
        "encoder_counter: "
        + ", ".join(f"{one['lc']} LC {one['fmax_mhz']:.1f} MHz" for one in found)
    )
    return found


def decoder_hx8k_lc(place: bool = True, seed: int = 1) -> float:
    if not place:
        return elaborated(source_of("encoder_counter"))
    return max(one["lc"] for one in hx8k(seed))


def decoder_hx8k_mhz(place: bool = True, seed: int = 1) -> float:
    if not place:
        return elaborated(source_of("encoder_counter"))
    return min(one["fmax_mhz"] for one in hx8k(seed))


FIGURES = {
    "decoder_miscounts": Figure(
        decoder_miscounts,
        "cycles",
        "cycles with a wrong count in 10^7 edges at x4, with jitter and glitches shorter than the "
        "filter, random reversals, an index every 1000 counts; no bounce within the filter's time "
        "after an edge",
        "0",
        Quick({"edges": 300_000}, "300 000 edges"),
        0,
    ),
    "decoder_hx8k_lc": Figure(
        decoder_hx8k_lc,
        "LC",
        "encoder_counter (for comparison: in no product) with bus, filter, index, probe, flags and "
        "time stamp on an iCE40 HX8K, worst of five placements",
        "< 224",
        ELABORATED,
        0,
        "HostMot2 224",
    ),
    "decoder_hx8k_mhz": Figure(
        decoder_hx8k_mhz,
        "MHz",
        "highest clock of the same, worst of five placements",
        "> 129",
        ELABORATED,
        1,
        "HostMot2 129",
    ),
}

CAMPAIGNS = {
    "decoder": Campaign(
        "edges of A and B at x4 with jitter, glitches and reversals; failed: cycles with a wrong "
        "count",
        lambda part, seed: encoder_run(SHARE, seed),
        parts=1000,
        tried="edges",
        failed="wrong",
    )
}

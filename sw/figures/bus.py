# SPDX-License-Identifier: Apache-2.0
"""Figures of the line: is anything wrong ever obeyed, does it come back after any disturbance, how
far may the clocks differ, how long
does a read take.

The first three are measured on the Verilated line of a node with the node's firmware behind its
registers (bus_run.cpp), the last on a
whole node of the twin. A frame counts as obeyed when the hardware marks it good, whatever the
firmware would then make of it.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from figures.common import Figure, bar, console
from moire.bus.protocol import parse_reply, read_words
from moire.client.bus import Bus
from moire.errors import BusError
from twin import Node, Twin, TwinTransport
from twin.build import run, simulation

ROOT = Path(__file__).resolve().parents[2]
RTL = ROOT / "rtl" / "rs485_port.sv"
DRIVER = Path(__file__).with_name("bus_run.cpp")
FRAMES = 10  # that bus_run knows
RANDOM = 10**6
DISTURBANCES = 10**5
SHARE = 10_000  # of one run, each with a seed of its own
BIT_CLK = (16, 17.36, 20, 20.83, 34.72)  # 3 M baud at 60 MHz is 20, 115200 at 2.4 MHz is 20.83
CLK_HZ = 60_000_000
BAUD = 1_000_000
READS = 300
REPLY_WORDS = 17  # ready byte, length, 11 of the body, CRC-32


@cache
def program():
    return simulation(DRIVER, RTL, firmware="axis", CLK_HZ=1_843_000)


def together(runs):
    """What each run of bus_run prints, as numbers; as many at once as there are processors."""
    program()
    with ThreadPoolExecutor(os.cpu_count()) as pool, bar("runs") as progress:
        task = progress.add_task("", total=len(runs))

        def measure(arguments):
            printed = run([program(), *arguments], "bus_run").split()
            progress.advance(task)
            return [float(word) for word in printed]

        return list(pool.map(measure, runs))


def random_runs(count):
    return [
        ("random", min(SHARE, count - first), seed)
        for seed, first in enumerate(range(0, count, SHARE), start=1)
    ]


def wrong_of(runs):
    told = together(runs)
    totals = {}
    for (kind, *_), (tried, wrong, missed) in zip(runs, told, strict=True):
        sums = totals.setdefault(kind, [0, 0, 0])
        totals[kind] = [a + b for a, b in zip(sums, (tried, wrong, missed), strict=True)]
    for kind, (tried, wrong, missed) in totals.items():
        console.print(
            f"{kind}: {tried:.0f} damaged frames, {wrong:.0f} accepted; of the good ones between them {missed:.0f} refused"
        )
        if missed:
            raise BusError(
                1, f"{missed:.0f} good frames were refused: a count of wrong ones means nothing"
            )
    return sum(wrong for _, wrong, _ in totals.values())


def line_wrong_accepted():
    every = range(FRAMES)
    return wrong_of(
        [("flips", n) for n in every] + [("bursts", n, n + 1) for n in every] + random_runs(RANDOM)
    )


def line_resync_failures(count=DISTURBANCES):
    told = together(
        [
            ("disturb", min(SHARE, count - first), seed)
            for seed, first in enumerate(range(0, count, SHARE), start=1)
        ]
    )
    console.print(
        f"{sum(tried for tried, _ in told):.0f} disturbances, each followed by a character of silence and a good exchange"
    )
    return sum(refused for _, refused in told)


def line_baud_pct():
    told = together([("baud", bit_clk, 1) for bit_clk in BIT_CLK])
    for bit_clk, (slow, fast) in zip(BIT_CLK, told, strict=True):
        console.print(
            f"{bit_clk} clk a bit: frames are lost from {slow} % too slow and {fast} % too fast on"
        )
    return min(value for pair in told for value in pair) - 0.1  # the steps are 0.1 %


def line_roundtrip_us():
    with Twin(nodes=[Node(1)], clk_hz=CLK_HZ) as twin:
        port = TwinTransport(twin)
        bus = Bus(port)
        twin.run(0.1)  # the firmware starts
        axis = bus.axis(1)
        axis.enable()
        bus.set_baud(BAUD, [1])
        began = twin.time()
        axis.request("position")
        whole = twin.time() - began
        axis.request("follow")
        took = [read_us(twin) for _ in range(READS)]
        axis.disable()
    console.print(
        f"{READS} reads of a followed position at {BAUD} baud, clk {CLK_HZ / 1e6:.0f} MHz, drive on: "
        f"{min(took):.1f} to {max(took):.1f} us, of which {(1 + REPLY_WORDS) * 11 / BAUD * 1e6:.0f} are characters; "
        f"a request `position` and its reply: {whole * 1e6:.0f} us"
    )
    return max(took)


def read_us(twin):
    """From the start bit of the master's command byte to the last stop bit, and the turn-round
    before the next.
    """
    twin.run(1e-3 / 7)  # the firmware is somewhere else each time
    began = twin.time()
    twin.send_words(read_words(1))
    if twin.run_until_words(REPLY_WORDS, 0.01) < REPLY_WORDS:
        raise BusError(1, "a read got no answer")
    words = twin.receive_words()
    if parse_reply(bytes(words[2:-4])) is None:
        raise BusError(1, "a read got a wrong answer")
    return (
        twin.time() - began + (0.5 + 2) / BAUD
    ) * 1e6  # the host has a word in the middle of its stop bit


FIGURES = {
    "line_wrong_accepted": Figure(
        line_wrong_accepted,
        "frames",
        "all 1-, 2- and 3-bit flips of 10 frames, bursts to 16 bits, 10^6 random "
        "frames, against RTL and firmware",
        "0",
        lambda value: value == 0,
        0,
    ),
    "line_resync_failures": Figure(
        line_resync_failures,
        "exchanges",
        "good exchanges refused after 10^5 disturbances and a character of silence",
        "0",
        lambda value: value == 0,
        0,
    ),
    "line_baud_pct": Figure(
        line_baud_pct,
        "%",
        "error-free mismatch of the clocks, worst frame, sign and phase, from 16 clk a bit up",
        ">= 3.5",
        lambda value: value >= 3.5,
        1,
    ),
    "line_roundtrip_us": Figure(
        line_roundtrip_us,
        "us",
        "position read at 1 Mbaud from a node with a clk of 60 MHz, host time excluded, "
        f"worst of {READS}",
        "<= 250",
        lambda value: value <= 250,
        1,
    ),
}
SOAK = {"line": lambda: (wrong := wrong_of(random_runs(10**9)), wrong == 0)}

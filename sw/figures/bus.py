# SPDX-License-Identifier: Apache-2.0
"""Figures of the RS-485 bus: is a damaged frame ever accepted, does a node recover after any
disturbance, how far may the clocks differ, and how long does a read take.

The first three are measured on the Verilated port of a node with the firmware behind its registers
(bus_run.cpp), the last on a whole node of the twin. A frame counts as accepted when the hardware
marks it as good, whatever the firmware would do with it then.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, bar, console, shares
from moire.bus.protocol import parse_reply, read_words
from moire.client.bus import Bus
from moire.errors import BusError
from twin import Node, Twin, TwinTransport
from twin.build import ROOT, run, simulation

RTL = ROOT / "rtl" / "rs485_port.sv"
DRIVER = Path(__file__).with_name("bus_run.cpp")
FRAMES = 10  # that bus_run knows
RANDOM = 10**6
FRAMES_A_PART = 10**5  # of the campaign
DISTURBANCES = 10**5
SHARE = 10_000  # of one run, each with a seed of its own
# 16.0625: the least tolerant one, 20: 3 Mbaud at 60 MHz, 20.83: 115200 at 2.4 MHz
BIT_CYCLES = (16, 16.0625, 17.36, 20, 20.83, 34.72)
CLK_HZ = 60_000_000
BAUD = 1_000_000
READS = 300
REPLY_WORDS = 17  # ready byte, length, 11 of the body, CRC-32


Run = tuple[str | float, ...]  # arguments of bus_run


@cache
def program() -> Path:
    return simulation(DRIVER, RTL, firmware="axis", CLK_HZ=1_843_000)


def numbers_of(*arguments: str | float) -> list[float]:
    """What a run of bus_run prints."""
    return [float(word) for word in run([program(), *arguments], "bus_run").split()]


def together(runs: Sequence[Run]) -> list[list[float]]:
    """What each run of bus_run prints, as numbers; as many at once as there are processors."""
    program()
    with ThreadPoolExecutor(os.cpu_count()) as pool, bar("runs") as progress:
        task = progress.add_task("", total=len(runs))

        def measure(arguments: Run) -> list[float]:
            numbers = numbers_of(*arguments)
            progress.advance(task)
            return numbers

        return list(pool.map(measure, runs))


def random_runs(count: int, seed: int = 1) -> list[Run]:
    return [("random", size, number) for size, number in shares(count, SHARE, seed)]


def wrong_of(runs: Sequence[Run]) -> float:
    totals: dict[str | float, list[float]] = {}
    for (kind, *_), (tried, wrong, missed) in zip(runs, together(runs), strict=True):
        sums = totals.setdefault(kind, [0, 0, 0])
        totals[kind] = [a + b for a, b in zip(sums, (tried, wrong, missed), strict=True)]
    for kind, (tried, wrong, missed) in totals.items():
        console.print(
            f"{kind}: {tried:.0f} damaged frames, {wrong:.0f} accepted; "
            f"of the good ones between them {missed:.0f} refused"
        )
        if missed:
            raise BusError(
                1, f"{missed:.0f} good frames were refused: the count of wrong ones means nothing"
            )
    return sum(wrong for _, wrong, _ in totals.values())


def line_wrong_accepted(
    flipped: int = FRAMES, frames: int = FRAMES, count: int = RANDOM, seed: int = 1
) -> float:
    """Of all flips of some frames, the bursts of some frames, and random frames."""
    flips = [("flips", n) for n in range(flipped)]
    bursts = [("bursts", n, n + seed) for n in range(frames)]
    return wrong_of(flips + bursts + random_runs(count, seed))


def line_resync_failures(count: int = DISTURBANCES, seed: int = 1) -> float:
    runs = [("disturb", size, number) for size, number in shares(count, SHARE, seed)]
    tried, refused = map(sum, zip(*together(runs)))
    console.print(
        f"{tried:.0f} disturbances, each followed by a character of silence and a good exchange"
    )
    return refused


def line_baud_pct(bit_times: Sequence[float] = BIT_CYCLES, seed: int = 1) -> float:
    limits = together([("baud", cycles, seed) for cycles in bit_times])
    for cycles, (slow, fast) in zip(bit_times, limits, strict=True):
        console.print(
            f"{cycles} cycles per bit: frames are lost from {slow} % too slow "
            f"and {fast} % too fast on"
        )
    return min(value for pair in limits for value in pair) - 0.1  # the steps are 0.1 %


def line_roundtrip_us(reads: int = READS) -> float:
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
        took = [read_us(twin) for _ in range(reads)]
        axis.disable()
    console.print(
        f"{reads} reads of a followed position at {BAUD} baud, clk {CLK_HZ / 1e6:.0f} MHz, "
        f"drive on: {min(took):.1f} to {max(took):.1f} us, of which "
        f"{(1 + REPLY_WORDS) * 11 / BAUD * 1e6:.0f} are characters; "
        f"a request `position` and its reply: {whole * 1e6:.0f} us"
    )
    return max(took)


def read_us(twin: Twin) -> float:
    """From the start bit of the master's command byte to the last stop bit, with the turn-round
    before the next command.
    """
    twin.run(1e-3 / 7)  # the firmware does something else each time
    began = twin.time()
    twin.send_words(read_words(1))
    if twin.run_until_words(REPLY_WORDS, 0.01) < REPLY_WORDS:
        raise BusError(1, "a read got no answer")
    words = twin.receive_words()
    if parse_reply(bytes(words[2:-4])) is None:
        raise BusError(1, "a read got a wrong answer")
    late = (0.5 + 2) / BAUD  # the host has a word in the middle of its stop bit
    return (twin.time() - began + late) * 1e6


FIGURES = {
    "line_wrong_accepted": Figure(
        line_wrong_accepted,
        "frames",
        "damaged frames accepted: all flips of 1, 2 and 3 bits of 10 frames, their bursts of up to "
        "16 bits, 10^6 random frames, into RTL and firmware",
        "0",
        Quick({"flipped": 0, "frames": 1, "count": 2000}, "the bursts of a frame, 2000 random"),
        0,
    ),
    "line_resync_failures": Figure(
        line_resync_failures,
        "exchanges",
        "good exchanges refused after 10^5 disturbances, each with a character of silence after it",
        "0",
        Quick({"count": 1000}, "1000 disturbances"),
        0,
    ),
    "line_baud_pct": Figure(
        line_baud_pct,
        "%",
        "total mismatch of the clocks without an error, worst frame, sign and phase, from 16 "
        "cycles per bit up",
        ">= 3.5",
        Quick({"bit_times": (16.0625,)}, "16.0625 cycles per bit"),
        1,
    ),
    "line_roundtrip_us": Figure(
        line_roundtrip_us,
        "us",
        "read of a followed position at 1 Mbaud from a node of the twin with a clock of 60 MHz, "
        f"time of the host excluded, worst of {READS}; a plain request takes about 380",
        "<= 250",
        Quick({"reads": 20}, "20 reads"),
        1,
    ),
}


def disturbed_frames(part: int, seed: int) -> Counts:
    """Half of the frames are damaged and must not be accepted; each of the other half follows a
    disturbance and must be answered.
    """
    half = FRAMES_A_PART // 2
    damaged, accepted, missed = numbers_of("random", half, seed)
    disturbed, refused = numbers_of("disturb", half, seed)
    return {
        "frames": damaged + disturbed,
        "failures": accepted + missed + refused,
        "damaged frames": damaged,
        "damaged frames accepted": accepted,
        "good frames between them refused": missed,
        "disturbances": disturbed,
        "good exchanges after them refused": refused,
    }


CAMPAIGNS = {
    "line": Campaign(
        "frames on the RS-485 bus under disturbance, into RTL and firmware; failed: damaged ones "
        "accepted, good ones refused",
        disturbed_frames,
        parts=10_000,
        tried="frames",
        failed="failures",
    )
}

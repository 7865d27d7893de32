# SPDX-License-Identifier: Apache-2.0
"""Figures of the PS/2 pass-through (S4): does every byte arrive, once and in order, and how late.

The bytes are judged by a keyboard and a host in C++ around the Verilated ps2_pass, and in part by
sigrok-cli, which knows nothing of our code. The campaign of 10^6 sequences is `make soak K=ps2`.
"""

import tempfile
from functools import cache
from pathlib import Path

from campaigns.campaign import Campaign
from figures.common import Absent, Figure, Quick, bar, console, seeds, shares
from tools import sigrok
from twin.build import ROOT, run, simulation
from twin.recordings import KEYBOARD, TYPED

PASS = ROOT / "rtl" / "peripheral" / "ps2_pass.sv"
DRIVER = Path(__file__).with_name("ps2_run.cpp")
CLK_HZ = 400_000
SEQUENCES = 10**4
SHARE = 1000  # sequences of one run, each with a seed of its own
BY_SIGROK = 1000


@cache
def program() -> Path:
    return simulation(DRIVER, PASS, CLK_HZ=CLK_HZ)


def sequences_run(count: int, seed: int) -> dict[str, float]:
    """What the program counts over so many random sequences, {name: number}."""
    words = run([program(), "sequences", count, seed], "ps2_run").split()
    return dict(zip(words[1::2], map(float, words[::2])))


def sequences(count: int = SEQUENCES, seed: int = 1) -> dict[str, float]:
    """Totals of random sequences: a person's keys, the host's commands, injections, and frames that
    the host cuts short.
    """
    totals: dict[str, float] = {}
    with bar(f"{count:.0e} sequences") as progress:
        task = progress.add_task("", total=count)
        for size, number in shares(count, SHARE, seed):
            for name, value in sequences_run(size, number).items():
                totals[name] = totals.get(name, 0) + value
            progress.advance(task, size)
    console.print(", ".join(f"{value:.0f} {name}" for name, value in totals.items()))
    return totals


def wrong_by_sigrok(count: int, seed: int) -> int:
    """Bytes that sigrok does not read as they were typed and injected: the recording, where there
    is one, then random sequences.
    """
    if not sigrok.installed():
        raise Absent("sigrok-cli is not installed: make sigrok")
    recorded = TYPED if KEYBOARD.exists() else b""
    with tempfile.TemporaryDirectory() as folder:
        samples = Path(folder) / "pass.bin"
        before = KEYBOARD if recorded else "-"
        words = run([program(), "wave", before, count, seed, samples], "ps2_run")
        read, errors = sigrok.ps2(samples.read_bytes(), CLK_HZ)
    judged, heard = words.splitlines()
    want = bytes.fromhex(heard)
    wrong = sum(a != b for a, b in zip(read, want)) + abs(len(read) - len(want))
    wrong += errors + int(judged) + (want[: len(recorded)] != recorded)
    console.print(
        f"sigrok: {len(read)} bytes read, {wrong} wrong; the first {len(recorded)} are the "
        f"recorded keyboard's{'' if recorded else f', for there is no {KEYBOARD}'}"
    )
    return wrong


def ps2_bytes_wrong(by_sigrok: int = BY_SIGROK, count: int = SEQUENCES, seed: int = 1) -> float:
    """Without sequences for sigrok, sigrok is not required."""
    wrong = wrong_by_sigrok(by_sigrok, seed) if by_sigrok else 0
    return wrong + sequences(count, seed)["wrong"]


def ps2_delay_us(bytes_each: int = 500, seed: int = 1) -> float:
    """The longest of two runs."""
    runs = [run([program(), "delay", bytes_each, one], "ps2_run") for one in seeds(seed, 2)]
    return max(float(words.split()[0]) for words in runs)


FIGURES = {
    "ps2_bytes_wrong": Figure(
        ps2_bytes_wrong,
        "bytes",
        "bytes wrong in pass-through and injection: 10^3 sequences, and a recorded keyboard where "
        "there is its recording, read by sigrok, 10^4 sequences with cut frames and commands read "
        "by our own host",
        "0",
        Quick({"by_sigrok": 0, "count": 200}, "200 sequences, without sigrok"),
        0,
    ),
    "ps2_delay_us": Figure(
        ps2_delay_us,
        "us",
        "eleventh edge in to eleventh edge out, less the ten bits of our frame, longest of 1000 "
        "bytes",
        "<= 200",
        Quick({"bytes_each": 50}, "100 bytes"),
        1,
    ),
}

CAMPAIGNS = {
    "ps2": Campaign(
        "sequences through the PS/2 pass-through: keys, commands of the host, injections, frames "
        "cut short; failed: bytes wrong",
        lambda part, seed: {"sequences": SHARE, **sequences_run(SHARE, seed)},
        parts=1000,
        tried="sequences",
        failed="wrong",
    )
}

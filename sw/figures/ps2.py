# SPDX-License-Identifier: Apache-2.0
"""Figures of the PS/2 pass-through (S4): does every byte arrive, once and in order, and how late.

The bytes are judged by a keyboard and a host in C++ around the Verilated ps2_pass, and on a part by
sigrok-cli, which knows nothing
of ours. The soak of 10^6 sequences is `make soak K=ps2`.
"""

import re
import shutil
import tempfile
from functools import cache
from pathlib import Path

from figures.common import Figure, bar, console
from twin import BuildError
from twin.build import run, simulation

ROOT = Path(__file__).resolve().parents[2]
PASS = ROOT / "rtl" / "peripheral" / "ps2_pass.sv"
DRIVER = Path(__file__).with_name("ps2_run.cpp")
RECORDING = ROOT.parent / "shared" / "captures" / "ps2_keyboard_asdfgh.csv"
TYPED = bytes.fromhex(
    "1c f0 1c 1b f0 1b 23 f0 23 2b f0 2b 34 f0 34 33 f0 33"
)  # what the recording holds: a s d f g h
CLK_HZ = 400_000
SEQUENCES = 10**4
SHARE = 1000  # sequences of one run, each with a seed of its own
BY_SIGROK = 1000


@cache
def program():
    return simulation(DRIVER, PASS, CLK_HZ=CLK_HZ)


def sequences(count=SEQUENCES):
    """Totals of random sequences: a person's keys, the host's commands, injections, and frames that
    the host cuts short.
    """
    totals = {}
    with bar(f"{count:.0e} sequences") as progress:
        task = progress.add_task("", total=count)
        for seed, first in enumerate(range(0, count, SHARE), start=1):
            words = run(
                [program(), "sequences", min(SHARE, count - first), seed], "ps2_run"
            ).split()
            for name, value in zip(words[1::2], map(float, words[::2])):
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=min(first + SHARE, count))
    console.print(", ".join(f"{value:.0f} {name}" for name, value in totals.items()))
    return totals


def wrong_by_sigrok():
    """Bytes that sigrok reads otherwise than they were typed and injected: the recording, then
    random sequences.
    """
    if not shutil.which("sigrok-cli") or not RECORDING.exists():
        raise BuildError(f"sigrok-cli (apt) and the recording {RECORDING} are needed")
    with tempfile.TemporaryDirectory() as folder:
        samples = Path(folder) / "pass.bin"
        judged, heard = run(
            [program(), "wave", RECORDING, BY_SIGROK, 1, samples], "ps2_run"
        ).splitlines()
        text = run(
            [
                "sigrok-cli",
                "-i",
                samples,
                "-I",
                f"binary:numchannels=2:samplerate={CLK_HZ}",
                "-P",
                "ps2:clk=0:data=1",
                "-A",
                "ps2=word:parity-err",
            ],
            "sigrok-cli",
        )
    read, want = (
        bytes(int(word, 16) for word in re.findall(r"Data: (\w\w)", text)),
        bytes.fromhex(heard),
    )
    wrong = (
        sum(a != b for a, b in zip(read, want))
        + abs(len(read) - len(want))
        + text.count("Parity error")
        + int(judged)
    )
    wrong += want[: len(TYPED)] != TYPED
    console.print(
        f"sigrok: {len(read)} bytes read, {wrong} wrong; the first {len(TYPED)} are the recorded keyboard's"
    )
    return wrong


def ps2_bytes_wrong():
    return wrong_by_sigrok() + sequences()["wrong"]


def ps2_delay_us():
    return max(float(run([program(), "delay", 500, seed], "ps2_run").split()[0]) for seed in (1, 2))


FIGURES = {
    "ps2_bytes_wrong": Figure(
        ps2_bytes_wrong,
        "bytes",
        "pass-through and injection: recording + 10^3 sequences by sigrok, 10^4 with cuts "
        "and commands by our own host",
        "0",
        lambda value: value == 0,
        0,
    ),
    "ps2_delay_us": Figure(
        ps2_delay_us,
        "us",
        "eleventh edge in to eleventh edge out, less the ten bits of our frame, longest of 1000",
        "<= 200",
        lambda value: value <= 200,
        1,
    ),
}

SOAK = {"ps2": lambda: (totals := sequences(10**6), totals["wrong"] == 0)}

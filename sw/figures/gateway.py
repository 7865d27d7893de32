# SPDX-License-Identifier: Apache-2.0
"""Figures of the gateway: how fast a stock client reads through it, and whether any input makes a
parser crash.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import serial

from campaigns.campaign import Campaign, Counts
from figures.common import Figure, Quick, console
from firmware import build as firmware_build
from fuzz import parser_fuzz
from moire.bus import cobs
from moire.bus.protocol import parse_reply, request_body
from moire.errors import MoireError
from twin import build
from twin.build import ROOT

FIRMWARE = ROOT / "sw" / "firmware"
FUZZER = ROOT / "sw" / "fuzz" / "firmware_fuzz.c"
C_FILES = (".c", ".h")
READ_S = 10
START_S = 3  # of reads that do not count: the firmware starts, and loads its tables
FUZZ_S = 600
SANITIZED = [
    "-std=gnu11",
    "-O1",
    "-g",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
    "-DMOIRE_REGISTER_ACCESS",
]


class NotMeasured(MoireError):
    """What the figure needs is missing."""


# ------------------------------------------------------------------ reads


def rfc2217_reads_per_s(seconds: float = READ_S, start_s: float = START_S) -> float:
    """Positions of a node of the twin, read one after the other by pyserial alone over RFC 2217 in
    8N1.
    """
    served = "twin --nodes 1 --http 0 --rfc2217 0 --tcp 0 --json".split()
    command = [sys.executable, "-m", "moire", *served]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        answer = twin.stdout.readline()
        if not answer.startswith('{"command": "twin"'):
            raise NotMeasured(f"the twin is not served: {answer.strip()}")
        try:
            with serial.serial_for_url(json.loads(answer)["rfc2217"], timeout=10) as port:
                read_positions(port, start_s)
                return read_positions(port, seconds)
        finally:
            twin.terminate()


def read_positions(port: serial.Serial, seconds: float) -> float:
    count, reader, began = 0, cobs.PacketReader(), time.perf_counter()
    while time.perf_counter() - began < seconds:
        port.write(cobs.packet(0x21, request_body("position", count, axis=0)))
        contents: list[bytes] = []
        while not contents:
            byte = port.read(1)
            if not byte:
                raise NotMeasured("a read got no answer")
            contents = reader.feed(byte + port.read(port.in_waiting))
        reply = parse_reply(cobs.body_of(contents[0]) or b"")
        if reply is None or (reply.sequence, reply.cause) != (count % 256, 0):
            raise NotMeasured("a read got a wrong answer")
        count += 1
    return count / (time.perf_counter() - began)


# ------------------------------------------------------------------ fuzzing


def build_firmware_fuzz(folder: Path, image: str, firmware: Path = FIRMWARE) -> Path:
    """An image of the firmware of this folder and its fuzzer as a program of this computer, by gcc
    with its sanitizers.
    """
    if shutil.which("gcc") is None:
        raise NotMeasured("gcc is missing: fuzzing the firmware needs its sanitizers")
    traced = ["-Dmain=firmware_main", "-fsanitize-coverage=trace-pc"]
    tools = firmware_build
    sources = [path for path in tools.sources_of(image, Path(firmware)) if path.suffix == ".c"]
    jobs = [(path, traced) for path in sources] + [(FUZZER, [])]
    objects = []
    for path, more in jobs:
        objects.append(folder / f"{path.stem}.o")
        flags = [*SANITIZED, *tools.defines_of(image), *more, f"-I{firmware}"]
        run(["gcc", *flags, "-c", path, "-o", objects[-1]])
    run(["gcc", "-fsanitize=address,undefined", *objects, "-o", folder / "fuzz"])
    return folder / "fuzz"


def run(command: Sequence[object]) -> None:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if done.returncode:
        first = (done.stderr.splitlines() or ["without a word"])[0]
        raise NotMeasured(f"the fuzzer does not build: {first}")


def images(firmware: Path = FIRMWARE) -> list[str]:
    return sorted(
        path.stem.removeprefix("image_") for path in (Path(firmware) / "images").glob("image_*.c")
    )


class Outcome(NamedTuple):
    image: str
    runs: int
    edges: int
    corpus: int
    crash: str | None  # words of a sanitizer, or about an input that took too long


def firmware_fuzzer(image: str, firmware: Path = FIRMWARE) -> Path:
    """The program of build_firmware_fuzz, built once."""
    files = [FUZZER, *sorted(path for path in Path(firmware).rglob("*") if path.suffix in C_FILES)]
    folder = ROOT / "build" / "fuzz" / f"{image}-{build.digest(files, SANITIZED)}"

    def make(making: Path) -> None:
        build_firmware_fuzz(making, image, firmware)

    return build.made_once(folder, "fuzz", make)


def fuzz_firmware(seconds: float, image: str, seed: int = 1, firmware: Path = FIRMWARE) -> Outcome:
    done = subprocess.run(
        [firmware_fuzzer(image, firmware), str(seconds), str(seed)],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "ASAN_OPTIONS": "detect_leaks=0:abort_on_error=1",
            "UBSAN_OPTIONS": "abort_on_error=1",
        },
    )
    if done.returncode:
        return Outcome(image, 0, 0, 0, done.stderr)
    runs, edges, corpus = map(int, done.stdout.split())
    return Outcome(image, runs, edges, corpus, None)


def host_parser_crashes(seconds: float = FUZZ_S, seed: int = 1) -> int:
    """Both at once, each on a processor of its own."""
    with ThreadPoolExecutor(1) as beside:
        names = images()
        firmware = beside.submit(
            lambda: [fuzz_firmware(seconds / len(names), image, seed) for image in names]
        )
        targets = parser_fuzz.fuzz(seconds, seed)
        outcomes = firmware.result()
    crashes = 0
    for outcome in outcomes:
        console.print(
            f"firmware, image {outcome.image}: {outcome.runs} scripts, {outcome.edges} edges, "
            f"a corpus of {outcome.corpus}"
        )
        if outcome.crash is not None:
            crashes += 1
            console.print(outcome.crash, markup=False)
    for target in targets:
        console.print(
            f"{target.parse.__name__}: {target.runs} inputs, {len(target.seen)} pairs of lines, "
            f"a corpus of {len(target.corpus)}"
        )
        for where, data in target.crashes.items():
            crashes += 1
            console.print(f"{where}: {data!r}", markup=False)
    return crashes


FIGURES = {
    "rfc2217_reads_per_s": Figure(
        rfc2217_reads_per_s,
        "1/s",
        "positions read per second by stock pyserial over RFC 2217, in 8N1, from a twin of one "
        "node with its drive off (36 to 56 with two nodes)",
        ">= 100",
        Quick({"seconds": 2, "start_s": 1}, "2 s of reads", "> 10"),
        0,
    ),
    "host_parser_crashes": Figure(
        host_parser_crashes,
        "crashes",
        "crashes in coverage-guided fuzzing of the parsers of host and firmware, the firmware's "
        f"under sanitizers, {FUZZ_S // 60} minutes",
        "0",
        Quick({"seconds": 2}, "2 seconds"),
        0,
    ),
}


# ------------------------------------------------------------------ the campaigns

PART_S = 86.4  # 1000 parts are 24 hours of a core for each parser


def fuzz_parser(name: str, part: int, seed: int) -> Counts:
    """In a process of its own: its clock needs the signals of the main thread."""
    command = [sys.executable, "-m", "fuzz.parser_fuzz", PART_S, seed, "--parser", name, "--json"]
    (found,) = json.loads(build.run(command, "parser_fuzz"))
    crashes = found["crashes"]
    counts = {"inputs": found["runs"], "crashes": len(crashes), "core-hours": PART_S / 3600}
    words = "\n".join(f"{where}: {data}" for where, data in crashes.items())
    return {**counts, "largest corpus": found["corpus"], **({"input": words} if words else {})}


def fuzz_image(name: str, part: int, seed: int) -> Counts:
    found = fuzz_firmware(PART_S, name, seed)
    crashed = found.crash is not None
    # A fuzzer that is ended by a crash does not say how many inputs came before it.
    counts = {"inputs": found.runs + crashed, "crashes": crashed, "core-hours": PART_S / 3600}
    words = {"input": found.crash} if found.crash is not None else {}
    return {**counts, "largest corpus": found.corpus, **words}


def fuzzing(what: str, run: Callable[[int, int], Counts]) -> Campaign:
    return Campaign(what, run, 1000, "inputs", "crashes", ("largest corpus",))


CAMPAIGNS = {
    **{
        f"fuzz_{parse.__name__}": fuzzing(
            f"inputs of the host's parser {parse.__name__}, guided by coverage; failed: crashes",
            partial(fuzz_parser, parse.__name__),
        )
        for parse in parser_fuzz.SEEDS
    },
    **{
        f"fuzz_firmware_{name}": fuzzing(
            f"scripts of bus, files and power cuts into the firmware image {name} under "
            "sanitizers, guided by coverage; failed: crashes",
            partial(fuzz_image, name),
        )
        for name in images()
    },
}

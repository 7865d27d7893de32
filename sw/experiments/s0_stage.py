# SPDX-License-Identifier: Apache-2.0
"""S0: the X-Y precision stage with a grating interferometer, one node an axis, both on one
multi-drop line.

    python -m experiments.s0_stage            (make demo)

Powers two nodes up with their stages at unknown places, finds and checks them, homes both, sends a
list of moves, X to its
accuracy and then Y, and writes build/report/index.html. The paper reached 0.8 um with the motors
alone.
"""

import argparse
import random
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from moire.analysis import report
from moire.client.bus import Bus
from moire.errors import MoireError
from twin import START_S, BuildError, Twin, TwinTransport

ROOT = Path(__file__).resolve().parents[2]
ADDRESSES = {"X": 1, "Y": 2}  # on the line; the order is that of the axes in the twin
PERIOD_NM = 800.0
POLL_S = 0.005  # between two looks at a motion
MOVES = 24


@dataclass
class Stage:
    """The simulated machine and the host that talks to it. `zero_nm` is the true place of each
    axis' zero.
    """

    twin: object
    bus: Bus
    axes: dict
    zero_nm: dict = field(default_factory=dict)

    @classmethod
    def power_up(cls, seed=1, **plant):
        twin = Twin(seed=seed, nodes=tuple(ADDRESSES.values()), plant=plant)
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed), poll_s=POLL_S)
        bus.transport.wait(START_S)
        return cls(twin, bus, {})

    def find(self):
        """Both nodes, checked against the tables that this host was made with."""
        found = [identity.address for identity in self.bus.find()]
        missing = [name for name, address in ADDRESSES.items() if address not in found]
        if missing:
            raise MoireError(
                f"no node answers for {' and '.join(missing)}; found addresses {found or 'none'}"
            )
        self.axes = {name: self.bus.axis(address) for name, address in ADDRESSES.items()}
        return [axis.node.identity for axis in self.axes.values()]

    def record_while_moving(self, name, progress=None):
        """A progress callback that also talks to the other axes, so that no drive hears silence."""

        def look(status):
            told = {
                other: status if other == name else axis.status()
                for other, axis in self.axes.items()
            }
            if progress is not None:
                progress(told)

        return look

    def dwell(self, seconds):
        """Let time pass, talking to all axes often enough for their watchdogs."""
        end = self.bus.transport.now() + seconds
        while self.bus.transport.now() < end:
            for axis in self.axes.values():
                axis.status()
            self.bus.transport.wait(max(0.0, min(0.05, end - self.bus.transport.now())))

    def home(self, name, progress=None):
        axis = self.axes[name]
        axis.enable()
        status = axis.home(progress=self.record_while_moving(name, progress))
        self.zero_nm[name] = (
            round((self.true_nm(name, from_zero=False) - status.position_nm) / PERIOD_NM)
            * PERIOD_NM
        )
        return status

    def true_nm(self, name, from_zero=True):
        """Where the table of this axis truly is: what no controller can see."""
        return self.twin.true_position_nm(list(ADDRESSES).index(name)) - (
            self.zero_nm[name] if from_zero else 0.0
        )

    def move(self, name, target_nm, progress=None):
        """Go there, wait until the node says that it arrived, and judge it by the true position."""
        began = self.bus.transport.now()
        status = self.axes[name].move(
            nm=target_nm, progress=self.record_while_moving(name, progress)
        )
        took = self.bus.transport.now() - began
        true = self.true_nm(name)
        return report.Move(name, target_nm, status.position_nm, true, true - target_nm, took)


def random_target(here_nm, source, shortest_nm=100.0, longest_nm=2e6, low_nm=0.0, high_nm=20e6):
    """A place whose distance from here is drawn log-uniformly between the shortest and the longest
    move.
    """
    while True:
        distance = shortest_nm * (longest_nm / shortest_nm) ** source.random()
        target = here_nm + source.choice((-1, 1)) * distance
        if low_nm <= target <= high_nm:
            return target


def random_moves(stage, count, seed, progress=None, done=None):
    """`count` moves, X and Y in turn; the targets are drawn from the seed."""
    source, here, moves = random.Random(seed), {name: 0.0 for name in stage.axes}, []
    for number in range(count):
        name = list(stage.axes)[number % len(stage.axes)]
        here[name] = random_target(here[name], source)
        moves.append(stage.move(name, here[name], progress))
        if done is not None:
            done(moves[-1])
    return moves


# ------------------------------------------------------------------ the experiment


class Recorder:
    """What the host saw while it watched."""

    def __init__(self, stage):
        self.stage = stage
        self.seen = {name: [] for name in stage.axes}  # (time, target, position) in s and nm
        self.samples = {name: [] for name in stage.axes}  # (sin, cos)

    def look(self, told):
        now = self.stage.bus.transport.now()
        for name, status in told.items():
            self.seen[name].append((now, status.target_nm, status.position_nm))
            if status.in_motion:
                encoder = self.stage.axes[name].encoder()
                self.samples[name].append((encoder.sin, encoder.cos))

    def traces(self):
        return [report.Trace(name, *map(list, zip(*rows))) for name, rows in self.seen.items()]

    def lissajous(self):
        return [
            report.Lissajous(name, *map(list, zip(*pairs)))
            for name, pairs in self.samples.items()
            if pairs
        ]


def position_words(told):
    return "   ".join(
        f"{name} {status.position_nm / 1e6:+11.6f} mm" for name, status in told.items()
    )


def run(seed=1, count=MOVES, folder=ROOT / "build" / "report", console=None):
    """The whole experiment; returns the moves and the path of the report."""
    console = console or Console()
    console.print(f"[bold]S0: X-Y stage, two nodes on one line[/] (seed {seed})")
    with console.status("building the twin: nodes, firmware, machine"):
        stage = Stage.power_up(seed)
    began = time.perf_counter()
    for name, identity in zip(ADDRESSES, stage.find()):
        console.print(
            f"  node {identity.address} is axis {name}: register map {identity.map_crc:08X} fits, "
            f"clk {identity.clk_hz / 1e6:g} MHz, servo {identity.tick_hz / 1e3:g} kHz, {identity.sample_hz / 1e3:g} kS/s"
        )
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[words]}"),
        console=console,
    ) as progress:
        task = progress.add_task("homing", total=len(stage.axes), words="")
        for name in stage.axes:
            stage.home(name, lambda told: progress.update(task, words=position_words(told)))
            progress.advance(task)
        recorder = Recorder(stage)
        task = progress.add_task("moves ", total=count, words="")

        def look(told):
            recorder.look(told)
            progress.update(task, words=position_words(told))

        moves = random_moves(stage, count, seed, look, lambda move: progress.advance(task))
    margins = ", ".join(
        f"{name} {axis.encoder().home_margin:.2f}" for name, axis in stage.axes.items()
    )
    for axis in stage.axes.values():
        axis.disable()
    simulated, wall = stage.bus.transport.now(), time.perf_counter() - began
    console.print(table(moves))
    errors = report.Errors.of(moves)
    result = report.Result(
        title="S0: X-Y stage with a grating interferometer",
        seed=seed,
        moves=moves,
        traces=recorder.traces(),
        lissajous=recorder.lissajous(),
        summary="Two axis nodes on one multi-drop line, simulated from the very RTL and firmware that go into the FPGA, closed around a "
        "model of the stage. Motors alone, no piezo. The true position is the model's; no controller sees it.",
        compared=[
            report.Compared(
                "coarse positioning error, motor only",
                "below 0.8 um",
                f"{errors.largest / 1000:.3f} um",
                errors.largest < report.PAPER_ERROR_NM,
            ),
            report.Compared("error, rms", "not given", f"{errors.rms / 1000:.4f} um"),
            report.Compared(
                "resolution of the read-out",
                "0.005 um (N = 160)",
                "0.005 um (N = 160); any N to 65 536",
                True,
            ),
            report.Compared(
                "top speed",
                "5 mm/s",
                f"{stage.axes['X'].get_parameter('velocity').written(4)} set",
                None,
            ),
        ],
        facts={
            "simulated time": f"{simulated:.2f} s",
            "wall time": f"{wall:.1f} s",
            "margin of the phase zero at homing (1: sure, 0: ambiguous)": margins,
            "line": f"{stage.bus.statistics.exchanges} exchanges, {stage.bus.statistics.repeats} repeated",
            "again": f"build/venv/bin/python -m experiments.s0_stage --seed {seed} --moves {count}",
        },
    )
    path = report.write(result, folder)
    console.print(
        f"largest error {errors.largest:.1f} nm, rms {errors.rms:.1f} nm (paper: below 800 nm); "
        f"{simulated:.1f} s simulated in {wall:.0f} s"
    )
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return moves, path


def table(moves):
    made = Table(
        "axis",
        *(
            f"{title}"
            for title in ("target / mm", "encoder / mm", "true / mm", "error / nm", "time / s")
        ),
        title="moves, error = true position - target",
    )
    for column in made.columns[1:]:
        column.justify = "right"
    for move in moves:
        made.add_row(
            move.axis,
            *(f"{value / 1e6:.6f}" for value in (move.target_nm, move.reached_nm, move.true_nm)),
            f"{move.error_nm:+.1f}",
            f"{move.time_s:.3f}",
        )
    return made


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m experiments.s0_stage",
        description="The S0 X-Y stage in the twin: home, move, report.",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the machine and of the targets (default 1)"
    )
    parser.add_argument(
        "--moves", type=int, default=MOVES, help=f"number of moves, 1 to 10000 (default {MOVES})"
    )
    parser.add_argument(
        "--report",
        type=Path,
        default=ROOT / "build" / "report",
        help="folder of the page (default build/report)",
    )
    options = parser.parse_args(arguments)
    if not 1 <= options.moves <= 10000:
        parser.error(f"--moves takes 1 to 10000, not {options.moves}")
    try:
        run(options.seed, options.moves, options.report)
    except (MoireError, BuildError) as error:
        print(f"s0_stage: {error}", file=sys.stderr)
        return getattr(error, "exit_code", 1)
    except KeyboardInterrupt:
        print("s0_stage: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

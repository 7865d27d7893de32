# SPDX-License-Identifier: Apache-2.0
"""S0 with its fine stage: the motor brings the table within reach, a piezo on the table takes the
rest.

    python -m experiments.s0_fine

Powers the X axis up with a piezo on its table, homes, learns the ellipse of sine and cosine in
motion, homes again with the correction
in force, switches the fine stage on, sends random moves and writes build/report/s0_fine/index.html.
The paper aims at 0.01 um.

The zero of an axis is the place where it stands when it is told to go to 0. That is 4.4 nm beside a
zero of the sine of this stage:
the correction turns the sine until it is square to the cosine, which is off by 2 degrees. It is the
same at every homing.
"""

import argparse
import random
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from experiments.s0_stage import ADDRESSES, POLL_S, ROOT, Stage, random_moves, table
from moire.analysis import report
from moire.client.bus import Bus
from moire.errors import MoireError
from twin import START_S, BuildError, Twin, TwinTransport
from twin.nodes.twin import drives

REQUIRED_NM = 10.0  # of the paper
NODE = {**drives("HAS_BRIDGE", "HAS_DAC", "HAS_FINE_STAGE"), "FILTERS": 0}
FINE = {
    "fine_ki": 20000
    / 2**24,  # 9 Hz: with twice as much the flexure's mode of 500 Hz, 25 times its own, would ring
    "fine_reach": "100nm",
    "settle_window": "3nm",
}
STROKES = ("0.7mm", "0.3mm")  # to and fro, while the ellipse is learned
MOST_STROKES = 30
ZERO_S = 0.2  # over which the place of the zero is averaged
HOLD_S = 1.0  # over which the jitter is
TRACE_HZ = 10_000
FOLDER = ROOT / "build" / "report" / "s0_fine"


@dataclass
class FineStage(Stage):
    """The stage of S0 with a piezo on the table of each axis; `sine_zero_nm` is the zero of the
    sine nearest to zero_nm.
    """

    sine_zero_nm: dict = field(default_factory=dict)

    @classmethod
    def power_up(cls, seed=1, names=("X",), **plant):
        twin = Twin(
            seed=seed,
            nodes=tuple(ADDRESSES[name] for name in names),
            plant={"piezo_fitted": 1, **plant},
            node_parameters=NODE,
        )
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed), poll_s=POLL_S)
        bus.transport.wait(START_S)
        return cls(twin, bus, {name: bus.axis(ADDRESSES[name]) for name in names})

    def calibrate_ellipse(self, name):
        """To and fro until an ellipse is accepted, which then stays in force; returns what the
        learner says.
        """
        axis = self.axes[name]
        axis.calibration("calibrate")
        for way in range(MOST_STROKES):
            axis.move(STROKES[way % len(STROKES)], progress=self.record_while_moving(name))
            if axis.calibration().accepted:
                break
        return axis.calibration("freeze")

    def prepare(self, name):
        """Home, learn, home again, fine stage on; then the zero is where the axis stands."""
        axis = self.axes[name]
        self.home(name)
        learned = self.calibrate_ellipse(name)
        self.home(name)
        self.switch_fine_on(name)
        axis.move(nm=0, progress=self.record_while_moving(name))
        self.sine_zero_nm[name] = self.zero_nm[name]
        self.zero_nm[name] += float(np.mean(self.watch(name, ZERO_S)["true_nm"]))
        return learned

    def switch_fine_on(self, name):
        for parameter, value in FINE.items():
            self.axes[name].set_parameter(parameter, value)

    def machine(self, name):
        return self.twin.machine(list(self.axes).index(name))

    def watch(self, name, seconds):
        """Let time pass; what the machine truly did, true_nm from the zero."""
        self.machine(name).trace(TRACE_HZ)
        self.dwell(seconds)
        return self.traced(name)

    def traced(self, name):
        """The trace that ends here, with the true position from the zero in nm."""
        machine = self.machine(name)
        trace = machine.take_trace()
        machine.trace(0)
        return {**trace, "true_nm": trace["position_m"] * 1e9 - self.zero_nm[name]}

    def watch_move(self, name, target_nm):
        """The move, and what the machine truly did in it."""
        self.machine(name).trace(TRACE_HZ)
        move = self.move(name, target_nm)
        return move, self.traced(name)


# ------------------------------------------------------------------ the experiment


def hand_over_picture(stage, name, target_nm):
    """One more move, drawn from where it is 2 um off: what is left, and what the piezo adds."""
    _, trace = stage.watch_move(name, target_nm)
    error = trace["true_nm"] - target_nm
    near = max(0, int(np.flatnonzero(np.abs(error) > 2000)[-1]))
    time_ms = (trace["time_s"][near:] - trace["time_s"][near]) * 1000
    figure, (whole, close) = report.drawing(height=3.6, ncols=2)
    for panel in (whole, close):
        panel.plot(
            time_ms,
            error[near:],
            color=report.colour(0),
            linewidth=1.2,
            label="true position - target",
        )
        panel.plot(
            time_ms,
            trace["piezo_m"][near:] * 1e9,
            color=report.colour(1),
            linewidth=1.2,
            label="of it the piezo's way",
        )
        panel.set_xlabel("time / ms")
    whole.set_ylabel("nm")
    close.set_ylim(-120, 120)
    report.legend(figure, whole)
    return report.png(figure)


def run(seed=1, count=24, folder=FOLDER, console=None):
    """The whole experiment; returns the moves and the path of the report."""
    console = console or Console()
    console.print(f"[bold]S0: one axis, motor and piezo[/] (seed {seed})")
    with console.status("building the twin: nodes, firmware, machine"):
        stage = FineStage.power_up(seed)
    began = time.perf_counter()
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
        console=console,
    ) as progress:
        task = progress.add_task("homing, learning", total=1)
        stage.prepare("X")
        progress.advance(task)
        task = progress.add_task("moves", total=count)
        moves = random_moves(stage, count, seed, done=lambda move: progress.advance(task))
    console.print(table(moves))
    jitter = float(np.std(stage.watch("X", HOLD_S)["true_nm"]))
    picture = hand_over_picture(stage, "X", moves[-1].target_nm + 2e5)
    errors = report.Errors.of(moves)
    result = report.Result(
        title="S0: coarse and fine together",
        seed=seed,
        moves=moves,
        paper_error_nm=REQUIRED_NM,
        drawn={"hand_over": ("The end of a move: the motor hands over to the piezo", picture)},
        summary="The X axis, simulated from the very RTL and firmware that go into the FPGA, closed around a model of the stage with a "
        "piezo on its table: hysteresis, creep, a mode at 500 Hz. The true position is the model's; no controller sees it.",
        compared=[
            report.Compared(
                "positioning error, motor and piezo",
                "aim 10 nm",
                f"{errors.largest:.1f} nm",
                errors.largest <= REQUIRED_NM,
            ),
            report.Compared("error, rms", "not given", f"{errors.rms:.2f} nm"),
            report.Compared("standstill jitter over 1 s", "not given", f"{jitter:.2f} nm rms"),
        ],
        facts={
            "zero beside a zero of the sine": f"{stage.zero_nm['X'] - stage.sine_zero_nm['X']:+.1f} nm",
            "simulated time": f"{stage.bus.transport.now():.2f} s",
            "wall time": f"{time.perf_counter() - began:.1f} s",
            "again": f"build/venv/bin/python -m experiments.s0_fine --seed {seed} --moves {count}",
        },
    )
    path = report.write(result, folder)
    stage.axes["X"].disable()
    console.print(
        f"largest error {errors.largest:.1f} nm, rms {errors.rms:.2f} nm (paper's aim: 10 nm); jitter {jitter:.2f} nm rms"
    )
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return moves, path


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m experiments.s0_fine",
        description="S0 with its fine stage: home, learn, move, report.",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the machine and of the targets (default 1)"
    )
    parser.add_argument(
        "--moves", type=int, default=24, help="number of moves, 2 to 10000 (default 24)"
    )
    parser.add_argument(
        "--report",
        type=Path,
        default=FOLDER,
        help="folder of the page (default build/report/s0_fine)",
    )
    options = parser.parse_args(arguments)
    if not 2 <= options.moves <= 10000:
        parser.error(f"--moves takes 2 to 10000, not {options.moves}")
    try:
        run(options.seed, options.moves, options.report)
    except (MoireError, BuildError) as error:
        print(f"s0_fine: {error}", file=sys.stderr)
        return getattr(error, "exit_code", 1)
    except KeyboardInterrupt:
        print("s0_fine: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

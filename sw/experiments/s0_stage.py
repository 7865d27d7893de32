# SPDX-License-Identifier: Apache-2.0
"""S0: the X-Y precision stage with a grating interferometer; each axis has a node, and both nodes
are on one RS-485 bus.

    python -m experiments.s0_stage            (make demo)

The experiment powers up two nodes with their stages at unknown positions, finds and checks the
nodes, homes both axes, makes a list of moves, in turn of X and of Y, measures the X axis as a
metrologist would, and writes build/report/s0_stage.html. The paper reached 0.8 um with the motors
alone.
"""

import random
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from experiments import command, start_page
from experiments.s0_metrology import Metrology, targets
from moire.analysis import report
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.records import CalibrationState, Identity, Status
from moire.errors import MoireError
from twin import Twin, TwinTransport
from twin.machines.machine import MachineHandle, Trace
from twin.nodes.twin import CLK_HZ, NODE

ADDRESSES = {"X": 1, "Y": 2}  # on the bus; the axes of the twin have the same order
PERIOD_NM = 800.0
POLL_S = 0.005  # between two polls of a motion
MOVES = 24
TRACE_HZ = 10_000.0
STILL_S, LONG_STILL_S = 1.0, 10.0  # the X axis holds its position
STEPS_FROM_NM = 1e6
TRAVEL_NM = (0.0, 20e6)  # of the test by ISO 230-2
RUNS = 5  # of that test, in each direction
STROKES = ("0.7mm", "0.3mm")  # targets of the strokes during the calibration
MOST_STROKES = 30
LEFT_OUT = (
    "errors of the scale along its travel, temperature, vibration of the floor, drift of the "
    "signals, noise of the amplifiers and of the DAC"
)

Statuses = Mapping[str, Status]  # the status of each axis, by its name


@dataclass
class Stage:
    """The simulated machine and its host.

    `zero_nm` is the true position of the zero of each axis.
    """

    twin: Twin
    bus: Bus
    axes: dict[str, Axis]
    zero_nm: dict[str, float] = field(default_factory=dict)

    @classmethod
    def power_up(
        cls,
        seed: int = 1,
        names: Sequence[str] = tuple(ADDRESSES),
        *,
        clk_hz: int = CLK_HZ,
        node_parameters: Mapping[str, int] = NODE,
        **plant: Any,
    ) -> Self:
        """The machine with these axes after power-up; `plant` overrides parameters of its model,
        `node_parameters` are those of rtl/node.sv.
        """
        twin = Twin(
            seed=seed,
            nodes=tuple(ADDRESSES[name] for name in names),
            clk_hz=clk_hz,
            plant=plant,
            node_parameters=node_parameters,
        )
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed), poll_s=POLL_S)
        twin.run_until_ready()
        return cls(twin, bus, {name: bus.axis(ADDRESSES[name]) for name in names})

    def find(self) -> list[Identity]:
        """Finds both nodes and checks that their register maps fit this host."""
        found = [identity.address for identity in self.bus.find()]
        missing = [name for name, address in ADDRESSES.items() if address not in found]
        if missing:
            raise MoireError(
                f"no node answers for {' and '.join(missing)}; found addresses {found or 'none'}"
            )
        self.axes = {name: self.bus.axis(address) for name, address in ADDRESSES.items()}
        return [axis.node.identity for axis in self.axes.values()]

    def record_while_moving(
        self, name: str, progress: Callable[[Statuses], object] | None = None
    ) -> Callable[[Status], None]:
        """A progress callback that also polls the other axes, so that no watchdog expires."""

        def poll(status: Status) -> None:
            statuses = {
                other: status if other == name else axis.status()
                for other, axis in self.axes.items()
            }
            if progress is not None:
                progress(statuses)

        return poll

    def dwell(self, seconds: float) -> None:
        """Lets time pass and polls all axes often enough for their watchdogs."""
        end = self.bus.transport.now() + seconds
        while self.bus.transport.now() < end:
            for axis in self.axes.values():
                axis.status()
            self.bus.transport.wait(max(0.0, min(0.05, end - self.bus.transport.now())))

    def home(self, name: str, progress: Callable[[Statuses], object] | None = None) -> Status:
        """Enables and homes an axis, and determines the true position of its zero."""
        axis = self.axes[name]
        axis.enable()
        status = axis.home(progress=self.record_while_moving(name, progress))
        self.zero_nm[name] = (
            round((self.true_nm(name, from_zero=False) - status.position_nm) / PERIOD_NM)
            * PERIOD_NM
        )
        return status

    def calibrate_ellipse(self, name: str) -> CalibrationState:
        """Moves an axis back and forth until the calibration accepts a measurement, and freezes the
        correction; returns the state of the calibration.
        """
        axis = self.axes[name]
        axis.calibration("calibrate")
        for stroke in range(MOST_STROKES):
            axis.move(STROKES[stroke % len(STROKES)], progress=self.record_while_moving(name))
            if axis.calibration().accepted:
                break
        return axis.calibration("freeze")

    def true_nm(self, name: str, from_zero: bool = True) -> float:
        """The true position of the table of this axis, which no controller can see."""
        return self.twin.true_position_nm(list(ADDRESSES).index(name)) - (
            self.zero_nm[name] if from_zero else 0.0
        )

    def machine(self, name: str) -> MachineHandle:
        """The model of this axis."""
        return self.twin.machine(list(self.axes).index(name))

    def watch(self, name: str, seconds: float, rate_hz: float = TRACE_HZ) -> Trace:
        """Lets time pass and returns the trace of the machine, see traced()."""
        self.machine(name).trace(rate_hz)
        self.dwell(seconds)
        return self.traced(name)

    def traced(self, name: str) -> Trace:
        """The trace until now, which ends; `true_nm` is the true position from the zero in nm."""
        machine = self.machine(name)
        trace = machine.take_trace()
        machine.trace(0)
        return {**trace, "true_nm": trace["position_m"] * 1e9 - self.zero_nm[name]}

    def move(
        self, name: str, target_nm: float, progress: Callable[[Statuses], object] | None = None
    ) -> report.Move:
        """Moves an axis, waits for the end of the motion, and measures the true error."""
        began = self.bus.transport.now()
        status = self.axes[name].move(
            nm=target_nm, progress=self.record_while_moving(name, progress)
        )
        took = self.bus.transport.now() - began
        true = self.true_nm(name)
        return report.Move(name, target_nm, status.position_nm, true, target_nm - true, took)


def random_target(
    here_nm: float,
    source: random.Random,
    shortest_nm: float = 100.0,
    longest_nm: float = 2e6,
    low_nm: float = 0.0,
    high_nm: float = 20e6,
) -> float:
    """A random target. Its distance from here is distributed log-uniformly between the shortest and
    the longest move.
    """
    while True:
        distance: float = shortest_nm * (longest_nm / shortest_nm) ** source.random()
        target = here_nm + source.choice((-1, 1)) * distance
        if low_nm <= target <= high_nm:
            return target


def spread(seed: str, places: int, high_nm: float) -> list[float]:
    """Random positions, one in each of so many equal parts of the way, in a random order."""
    source = random.Random(seed)
    found = [high_nm * (part + source.random()) / places for part in range(places)]
    source.shuffle(found)
    return found


def random_moves(
    stage: Stage,
    count: int,
    seed: int,
    progress: Callable[[Statuses], object] | None = None,
    done: Callable[[report.Move], object] | None = None,
    high_nm: float = 20e6,
    lengths_nm: tuple[float, float] = (100.0, 2e6),
    places: int = 1,
) -> list[report.Move]:
    """Makes `count` moves of the axes in turn, from 0 to `high_nm`, the shortest and the longest
    of `lengths_nm`; the seed determines the targets. They begin at 0. Since they reach a part of
    the way only, they may be divided among several `places`: somewhere in each of so many equal
    parts of the way. The moves that lead there are not among those that are returned.
    """
    source, here = random.Random(seed), {name: 0.0 for name in stage.axes}
    begins = {name: spread(f"{seed} {name}", places, high_nm) for name in stage.axes}
    moves: list[report.Move] = []
    for number in range(count):
        if places > 1 and number * places % count < places:  # the first move at a place
            for name, at in begins.items():
                here[name] = at.pop()
                stage.move(name, here[name], progress)
        name = list(stage.axes)[number % len(stage.axes)]
        here[name] = random_target(here[name], source, *lengths_nm, high_nm=high_nm)
        moves.append(stage.move(name, here[name], progress))
        if done is not None:
            done(moves[-1])
    return moves


# ------------------------------------------------------------------ the experiment


class Recorder:
    """Records what the host polls from the nodes."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        # (time, target, position) in s and nm
        self.seen: dict[str, list[tuple[float, float, float]]] = {name: [] for name in stage.axes}
        # (sin, cos)
        self.samples: dict[str, list[tuple[float, float]]] = {name: [] for name in stage.axes}

    def record(self, statuses: Statuses) -> None:
        """Adds these statuses, and a sample of sine and cosine of each axis that moves."""
        now = self.stage.bus.transport.now()
        for name, status in statuses.items():
            self.seen[name].append((now, status.target_nm, status.position_nm))
            if status.in_motion:
                encoder = self.stage.axes[name].encoder()
                self.samples[name].append((encoder.sin, encoder.cos))

    def traces(self) -> list[report.Trace]:
        """The recorded motion of each axis."""
        return [report.Trace(name, *map(list, zip(*rows))) for name, rows in self.seen.items()]

    def lissajous(self) -> list[report.Lissajous]:
        """The recorded samples of each axis that moved."""
        return [
            report.Lissajous(name, *map(list, zip(*pairs)))
            for name, pairs in self.samples.items()
            if pairs
        ]


def position_words(statuses: Statuses) -> str:
    """The positions of all axes in one line."""
    return "   ".join(
        f"{name} {status.position_nm / 1e6:+11.6f} mm" for name, status in statuses.items()
    )


def run(
    seed: int = 1,
    count: int = MOVES,
    folder: Path = start_page.FOLDER,
    thorough: bool = False,
    console: Console | None = None,
) -> tuple[list[report.Move], Path]:
    """Runs the whole experiment and returns the moves and the path of the report."""
    console = console or Console()
    console.print(f"[bold]S0: X-Y stage, two nodes on one bus[/] (seed {seed})")
    with console.status("building the twin: nodes, firmware, machine"):
        stage = Stage.power_up(seed)
    began = time.perf_counter()
    for name, identity in zip(ADDRESSES, stage.find()):
        console.print(
            f"  node {identity.address} is axis {name}: register map {identity.map_crc:08X} fits, "
            f"clk {identity.clk_hz / 1e6:g} MHz, servo {identity.tick_hz / 1e3:g} kHz, "
            f"{identity.sample_hz / 1e3:g} kS/s"
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
            stage.home(name, lambda statuses: progress.update(task, words=position_words(statuses)))
            progress.advance(task)
        recorder = Recorder(stage)
        task = progress.add_task("moves ", total=count, words="")

        def record(statuses: Statuses) -> None:
            recorder.record(statuses)
            progress.update(task, words=position_words(statuses))

        moves = random_moves(stage, count, seed, record, lambda move: progress.advance(task))
        task = progress.add_task("metrology", total=None, words="standstill, steps")
        measured = measure(stage, seed, thorough, lambda words: progress.update(task, words=words))
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
        drawn=measured.pictures(),
        claim=f"Largest error {errors.largest:.1f} nm, rms {errors.rms:.1f} nm in {errors.count} "
        "random moves with the motors alone; the paper's real stage kept 800 nm.",
        left_out=LEFT_OUT,
        summary="Two axis nodes are on one RS-485 bus. The simulation runs the same RTL and "
        "firmware as the FPGA, with a model of the stage. The motors position the stage without "
        "a piezo. The true position is the position of the model; no controller can see it.",
        compared=[
            report.Compared(
                "coarse positioning error, motor only",
                "below 0.8 \N{MICRO SIGN}m",
                f"{errors.largest / 1000:.3f} \N{MICRO SIGN}m",
                errors.largest < report.PAPER_ERROR_NM,
            ),
            report.Compared("error, rms", "not given", f"{errors.rms / 1000:.4f} \N{MICRO SIGN}m"),
            report.Compared(
                "resolution of the read-out",
                "0.005 \N{MICRO SIGN}m (N = 160)",
                "0.005 \N{MICRO SIGN}m (N = 160); any N to 65 536",
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
            **measured.words,
            "simulated time": f"{simulated:.2f} s",
            "wall time": f"{wall:.1f} s",
            "margin of the phase zero at homing (1: certain, 0: ambiguous)": margins,
            "bus": f"{stage.bus.statistics.exchanges} exchanges, "
            f"{stage.bus.statistics.repeats} repeated",
            "again": f"build/venv/bin/python -m experiments.s0_stage --seed {seed} --moves {count}"
            + (" --thorough" if thorough else ""),
        },
    )
    path = start_page.publish("s0_stage", report.page(result), folder)
    console.print(
        f"largest error {errors.largest:.1f} nm, rms {errors.rms:.1f} nm "
        "(the paper's real stage: below 800 nm); "
        f"{simulated:.1f} s simulated in {wall:.0f} s"
    )
    console.print(f"report with pictures: {path}", soft_wrap=True)
    console.print(f"all reports: {path.with_name('index.html')}", soft_wrap=True)
    return moves, path


def measure(
    stage: Stage, seed: int, thorough: bool, say: Callable[[str], object] = lambda words: None
) -> Metrology:
    """Measures the X axis: standstill, steps over a signal period, and in a thorough measurement
    also the steps after a calibration, and a test by ISO 230-2.
    """
    measured = Metrology(stage, "X")
    measured.stand_still(LONG_STILL_S if thorough else STILL_S)
    measured.step(STEPS_FROM_NM, "before the calibration")
    if thorough:
        say("calibration")
        stage.calibrate_ellipse("X")
        stage.home("X")
        measured.step(STEPS_FROM_NM, "after the calibration")
        say("ISO 230-2")
        measured.run_iso_230_2(targets(*TRAVEL_NM, seed), RUNS)
    return measured


def table(moves: Sequence[report.Move]) -> Table:
    """The moves as a table for the terminal."""
    made = Table(
        "axis",
        *(
            f"{title}"
            for title in ("target / mm", "encoder / mm", "true / mm", "error / nm", "time / s")
        ),
        title="moves, error = target - true position",
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment from the command line and returns the exit code."""
    parser = command.parser_of(
        "s0_stage",
        "The X-Y stage of S0 in the twin: it homes, moves and writes a report.",
        "the targets",
    )
    command.add_number(parser, "--moves", "moves", MOVES)
    parser.add_argument(
        "--thorough",
        action="store_true",
        help="adds ten seconds of standstill, a calibration, and a test of the X axis by ISO 230-2 "
        "over its travel: some minutes",
    )
    asked = parser.parse_args(arguments)
    return command.exit_code(
        "s0_stage", lambda: run(asked.seed, asked.moves, asked.report, asked.thorough)
    )


if __name__ == "__main__":
    sys.exit(main())

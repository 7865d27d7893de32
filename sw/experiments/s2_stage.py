# SPDX-License-Identifier: Apache-2.0
"""S2: three axes in one node, with grating scales as feedback and steppers on 5 mm screws.

    python -m experiments.s2_stage

The experiment homes all three axes with the switch and the index (method 1) and sets the origin to
the middle of each travel. It moves at 30 mm/min and faster, to both sides of the origin and beyond
the range of a 16-bit and of a 32-bit counter, and compares the counts of every move with the pulses
of the scale. It writes build/report/s2_stage.html.

The clock frequency of the node limits the speed of the scale: the node counts one count per cycle.
The twin runs at 4.8 MHz, and here X and Y move at 100 mm/s and Z at 25 mm/s. The figure
s2_count_errors measures 500 mm/s, which is 1000 times the top speed of the paper and 1 or 5 million
counts per second.
"""

import random
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Self

from rich.console import Console
from rich.table import Table

from experiments import command, start_page
from experiments.report_page import picture, text_of
from moire.analysis import report
from moire.client.axis import Axis as ClientAxis
from moire.client.bus import Bus
from moire.client.records import Status
from moire.units import Value
from twin import Twin, TwinTransport
from twin.nodes.twin import Axis, Node, drives

CLK_HZ = 4_800_000  # a tick has the cycles that the motion engine needs for three axes
NODE = {**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0}
POLL_S = 0.02
SLOW_MM_S = 0.5  # the paper's top speed, 30 mm/min
WORD = 1 << 16  # range of the counter of the paper
LEFT_OUT = "errors of the scales and of their edges, noise on the levels, temperature"


@dataclass(frozen=True)
class Scale:
    """The scale, the travel and the stepper of an axis."""

    count_um: Fraction
    travel_mm: int
    step_um: Fraction  # one microstep of the driver on the screw
    top_mm_s: int
    lead_mm: int = 5  # of the screw

    @property
    def period_um(self) -> Fraction:
        """The signal period of the scale."""
        return 4 * self.count_um

    @property
    def middle(self) -> int:
        """The middle of the travel, in periods from the index at its low end."""
        return round(Fraction(self.travel_mm * 1000, 2) / self.period_um)

    @property
    def word_mm(self) -> float:
        """The distance after which a 16-bit counter overflows."""
        return float(WORD * self.count_um) / 1000

    def machine(self) -> Axis:
        """The model of this axis."""
        count = float(self.count_um) * 1e-6
        return Axis(
            "stepper_stage",
            {
                "scale_count": count,
                "scale_index_position": count / 2,
                "scale_index_width": count,
                "scale_index_scatter": count / 25,
                "stepper_microsteps": round(Fraction(1000 * self.lead_mm, 200) / self.step_um),
                "screw_lead": self.lead_mm * 1e-3,
                "switch_high": self.travel_mm * 1e-3 + 2e-3,
                "travel_high_stop": self.travel_mm * 1e-3 + 3e-3,
            },
        )

    def settings(self) -> dict[str, Value]:
        """The parameters of the node for this axis."""
        edge = Fraction(self.travel_mm, 2) + 1
        return {
            "period": f"{float(self.period_um)}um",
            "counts_per_period": 4,
            "position_source": 1,
            "drive": 1,
            "disagreement_limit": 0,
            "encoder_fault_mask": 1,
            "deglitch": 0,
            "velocity_quantum": f"{float(self.count_um)}um",
            "steps_per_period": self.period_um / self.step_um,
            "step_trim": 5,
            "kp": 0,
            "kd": 0,
            "kv": 0,
            "ka": 0,
            "ki": 0.0004,
            "integral_limit": 0.99,
            "output_limit": 0.99,
            "dead_band": f"{float(3 * self.count_um)}um",
            "settle_window": f"{float(4 * self.count_um)}um",
            "settle_time": "20ms",
            "following_limit": "1mm",
            "travel_low": f"{float(-edge)}mm",
            "travel_high": f"{float(edge)}mm",
            "acceleration": "1m/s2",
            "jerk": "50m/s3",
            "velocity": f"{self.top_mm_s}mm/s",
            "home_method": 1,
            "homing_search_speed": "20mm/s",
            "homing_latch_speed": "5mm/s",
            "home_distance": "4mm",
        }


SCALES = {
    "X": Scale(Fraction(1, 2), 150, Fraction(5, 4), 100),
    "Y": Scale(Fraction(1, 2), 150, Fraction(5, 4), 100),
    "Z": Scale(Fraction(1, 10), 50, Fraction(1, 4), 25),
}


@dataclass(frozen=True)
class Move:
    """One move of an axis, and its counts."""

    axis: str
    what: str
    speed_mm_s: float
    target_um: float
    counts: int  # of the node, after the move
    given: int  # pulses of the scale in this move
    counted: int  # counts of the node in this move
    apart_um: float  # distance of the table by the model minus distance by the node
    heading: str

    @property
    def wrong(self) -> int:
        """The number of pulses that were counted wrongly."""
        return abs(self.given - self.counted)


@dataclass
class Stage:
    """The simulated machine, its node and its host."""

    twin: Twin
    bus: Bus
    axes: dict[str, ClientAxis]
    scales: Mapping[str, Scale] = field(default_factory=lambda: SCALES)
    polled: Callable[[], object] = lambda: None  # called at each poll of a motion
    seen: dict[str, list[tuple[float, int]]] = field(init=False)  # (time, counts)

    def __post_init__(self) -> None:
        self.seen = {name: [] for name in self.scales}

    @classmethod
    def power_up(
        cls, seed: int = 1, clk_hz: int = CLK_HZ, scales: Mapping[str, Scale] = SCALES
    ) -> Self:
        """The machine after power-up, with the parameters of this experiment."""
        twin = Twin(
            [Node(1, [scale.machine() for scale in scales.values()])],
            seed=seed,
            clk_hz=clk_hz,
            node_parameters=NODE,
        )
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed), poll_s=POLL_S)
        twin.run_until_ready()
        axes = {name: bus.axis(1, number) for number, name in enumerate(scales)}
        stage = cls(twin, bus, axes, scales)
        for name, scale in scales.items():
            for parameter, value in scale.settings().items():
                stage.axes[name].set_parameter(parameter, value)
            stage.axes[name].set_parameter(
                "home_offset", f"{float(-scale.middle * scale.period_um)}um"
            )
        return stage

    def number(self, name: str) -> int:
        """The number of this axis."""
        return list(self.scales).index(name)

    def together(
        self, begin: Callable[[str, ClientAxis], object], names: Iterable[str]
    ) -> dict[str, Status]:
        """Begins a motion of several axes and waits until all have ended."""
        for name in names:
            begin(name, self.axes[name])
        waiting, ended = set(names), dict[str, Status]()
        while waiting:
            self.bus.transport.wait(POLL_S)
            self.polled()
            for name in sorted(waiting):
                status = self.axes[name].status()
                self.seen[name].append((self.bus.transport.now(), status.counts))
                if status.ended != "running":
                    waiting.discard(name)
        for name in names:
            # raises an error unless the motion ended as commanded
            ended[name] = self.axes[name].wait()
        return ended

    def home(self) -> dict[str, Status]:
        """Enables and homes all axes."""
        for axis in self.axes.values():
            axis.enable()
        return self.together(lambda name, axis: axis.request("home"), self.axes)

    def both(self, name: str) -> tuple[int, int, float]:
        """(counts of the scale, counts of the node, true position in um) while the scale did not
        change: the node is asked again until none of its edges came meanwhile, since a table that
        still swings about an edge may swing in step with the polls.
        """
        number = self.number(name)
        while True:
            before = self.twin.truth(number)
            counts = self.axes[name].status().counts
            if self.twin.truth(number).scale_changes == before.scale_changes:
                return before.scale_counts, counts, before.position_m * 1e6

    def move(
        self, what: str, targets_um: Mapping[str, float], speed_mm_s: float | None = None
    ) -> list[Move]:
        """Moves all named axes at once. Without a speed, each axis moves at its top speed."""
        before = {name: self.both(name) for name in targets_um}
        made: list[Move] = []
        speeds = {name: speed_mm_s or self.scales[name].top_mm_s for name in targets_um}
        for name, speed in speeds.items():
            self.axes[name].set_parameter("velocity", f"{speed}mm/s")
        self.together(
            lambda name, axis: axis.request("move", target=axis.to_counts(targets_um[name] * 1000)),
            targets_um,
        )
        for name, target in targets_um.items():
            now = self.both(name)
            given, counted = now[0] - before[name][0], now[1] - before[name][1]
            apart = now[2] - before[name][2] - counted * float(self.scales[name].count_um)
            made.append(
                Move(
                    name,
                    what,
                    speeds[name],
                    target,
                    now[1],
                    given,
                    counted,
                    apart,
                    "up" if given > 0 else "down",
                )
            )
        return made

    def call_here(self, name: str, periods: int) -> None:
        """Sets the present position of an axis to this value (homing method 35). The limits of the
        travel are shifted with it.
        """
        axis, scale = self.axes[name], self.scales[name]
        for end, side in (("travel_low", -1), ("travel_high", 1)):
            axis.write_parameter(end, (periods + side * scale.middle) << 16)
        axis.set_parameter("home_method", 35)
        axis.write_parameter("home_offset", periods)
        axis.home()


def moves(stage: Stage, done: Callable[[], object] | None = None) -> list[Move]:
    """The moves of the experiment after homing; all three axes make each of them."""
    made: list[Move] = []

    def go(what: str, share: float, speed: float | None = None, by_um: float = 0.0) -> None:
        made.extend(
            stage.move(
                what,
                {name: share * scale.word_mm * 1000 + by_um for name, scale in SCALES.items()},
                speed,
            )
        )
        if done is not None:
            done()

    go("to point A, half a 16-bit counter above the origin", 0.5)
    go("through the origin to point B, as many counts below it", -0.5)
    go("30 mm/min", -0.5, SLOW_MM_S, 200.0)
    go("ten times that", -0.5, 10 * SLOW_MM_S, 2000.0)
    go("over the limit of a 16-bit counter", 0.75)
    go("back to the origin", 0.0)
    for name in SCALES:
        stage.call_here(name, 1 << 29)  # 2^31 counts: the limit of a signed 32-bit counter
    border = {name: (1 << 31) * float(scale.count_um) for name, scale in SCALES.items()}
    for what, side in (("below 2^31 counts", -1), ("above 2^31 counts", 1)):
        made.extend(stage.move(what, {name: border[name] + side * 1000 for name in SCALES}))
        if done is not None:
            done()
    return made


# ------------------------------------------------------------------ the experiment

HEAD = (
    "axis",
    "move",
    "speed / mm/s",
    "pulses of the scale",
    "counted",
    "wrong",
    "table minus node / \N{MICRO SIGN}m",
    "counts",
    "16-bit counter",
    "direction",
)


def rows(made: Sequence[Move]) -> list[Sequence[report.Cell]]:
    """The rows of the table of moves."""
    return [
        (
            move.axis,
            move.what,
            f"{move.speed_mm_s:g}",
            f"{move.given:+d}",
            f"{move.counted:+d}",
            (str(move.wrong), "bad" if move.wrong else "good"),
            f"{move.apart_um:+.2f}",
            f"{move.counts:+d}",
            str(move.counts % WORD),
            move.heading,
        )
        for move in made
    ]


def pictures(stage: Stage) -> str:
    """The picture of the positions, as HTML."""
    figure, (positions_panel, words) = report.drawing(height=4.2, ncols=2)
    for number, (name, seen) in enumerate(stage.seen.items()):
        # until the position is set to 2^31 counts
        seen = [(time, counts) for time, counts in seen if abs(counts) < 1 << 20]
        times, counts = zip(*seen)
        positions = [count * float(SCALES[name].count_um) / 1000 for count in counts]
        positions_panel.plot(
            times, positions, color=report.colour(number), linewidth=0.9, label=name
        )
        if name == "X":
            words.plot(
                times,
                [count % WORD for count in counts],
                color=report.colour(number),
                linewidth=0.9,
            )
    positions_panel.set(
        xlabel="time / s",
        ylabel="position / mm",
        title="homing, and moves on both sides of the origin",
    )
    positions_panel.legend(frameon=False, fontsize="small")
    words.set(xlabel="time / s", ylabel="16-bit counter", title="the counter of the paper for X")
    caption = (
        "Positions of the three axes, and a 16-bit reading, which is the same on both sides of the "
        "origin"
    )
    return picture("moves", caption, report.png(figure))


def run(
    seed: int = 1,
    folder: Path = start_page.FOLDER,
    console: Console | None = None,
) -> tuple[list[Move], Path]:
    """Runs the whole experiment and returns the moves and the path of the report."""
    console = console or Console()
    console.print(f"[bold]S2: three axes with scales in one node[/] (seed {seed})")
    with console.status("building the twin; homing and moving"):
        stage = Stage.power_up(seed)
        stage.home()
        made = moves(stage)
    shown = Table(*HEAD[:6], title="pulses of the scales, and counts of the node")
    for row in rows(made):
        shown.add_row(*(cell[0] if isinstance(cell, tuple) else cell for cell in row[:6]))
    console.print(shown)
    wrong, pulses = sum(move.wrong for move in made), sum(abs(move.given) for move in made)
    widest = max(abs(move.apart_um) / float(SCALES[move.axis].count_um) for move in made)
    long = [move for move in made if abs(move.given) > 10_000]
    share = max(
        abs(move.apart_um) / (abs(move.counted) * float(SCALES[move.axis].count_um))
        for move in long
    )
    compared = [
        report.Compared(
            "pulses of the scale minus pulses counted", "0", f"{wrong} of {pulses}", wrong == 0
        ),
        report.Compared(
            "difference relative to the distance",
            "within 1/10 000 of a digital read-out",
            f"1/{1 / share:,.0f} of the model's scale".replace(",", " "),
        ),
        report.Compared(
            "largest difference between table and node", "not given", f"{widest:.2f} counts"
        ),
        report.Compared(
            "side of the origin",
            "sum of 10 ms readings, by a direction bit",
            "sign of the position",
        ),
    ]
    text = text_of(
        "S2: three axes with direct scale input",
        "The simulation of three stepper axes in one node runs the same RTL and firmware as the "
        "FPGA. Points A and B are half the range of a 16-bit counter above and below the origin. "
        "The counter of the paper reads the same value at both points, and its direction bit "
        "indicates only the direction of the last pulse. The position of the node has 48 bits and "
        "a sign.",
        [
            report.against_the_paper(compared, LEFT_OUT),
            pictures(stage),
            report.table(HEAD, rows(made), text_columns=2),
        ],
        {
            "simulated time": f"{stage.bus.transport.now():.1f} s",
            "again": f"build/venv/bin/python -m experiments.s2_stage --seed {seed}",
        },
        claim=f"{wrong} of {pulses} pulses counted wrongly; the table and the position of the node "
        f"differ by {widest:.2f} counts at most.",
        left_out=LEFT_OUT,
    )
    path = start_page.publish("s2_stage", text, folder)
    console.print(
        f"{wrong} of {pulses} pulses counted wrongly; "
        f"table and node differ by {widest:.2f} counts at most"
    )
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return made, path


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment from the command line and returns the exit code."""
    parser = command.parser_of(
        "s2_stage", "S2 in the twin: it homes, moves, counts and writes a report."
    )
    asked = parser.parse_args(arguments)
    return command.exit_code("s2_stage", lambda: run(asked.seed, asked.report))


if __name__ == "__main__":
    sys.exit(main())

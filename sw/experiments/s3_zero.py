# SPDX-License-Identifier: Apache-2.0
"""S3: the zero point of a linear motor, searched from any position of rest.

    python -m experiments.s3_zero

The experiment powers up one node with a voice coil, a current amplifier, a 16-bit DAC, a 1 um scale
and its reference mark. Ten times the drive is switched off, the mover is left anywhere within 1 mm
of the mark, and the zero is searched (home_method -2): first in the positive direction and, if the
mark is not found, in the negative direction. The hardware latches the count at the rising edge of
the mark, always in the positive direction. The result is build/report/s3_zero.html. The zero of the
paper was within +-2 um.
"""

import math
import random
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from experiments import command, start_page
from experiments.report_page import picture, text_of
from moire.analysis import report
from moire.client.bus import Bus
from moire.client.index_survey import PASSES
from moire.client.records import IndexSurvey, Status
from moire.errors import NotSurveyed
from moire.units import Value
from twin import Twin, TwinTransport
from twin.machines.machine import Trace
from twin.nodes.twin import Axis, Node, drives
from twin.parameters import tables as parameters

CLK_HZ = 1_800_000  # a tick has the cycles that the motion engine needs, a count more than 20
NODE = {**drives("HAS_DAC"), "FILTERS": 0, "HAS_SINE": 0}
POLL_S = 0.01  # between two polls of a search
SEARCHES = 10  # as in table 1 of the paper
RANGE_M = 1e-3  # the mover is at rest within this distance of the mark
COUNT_M = 1e-6
COUNTS_PER_PERIOD = 4
PAPER_UM = 2.0
TICK_HZ = 4000
POSITION_LSB_M = COUNTS_PER_PERIOD * COUNT_M / 65536
FULL_SCALE = 32768  # of a command, and of kp, kd and kv; ki and ka have other scales

SETTINGS: dict[str, Value] = {
    "period": "4um",
    "counts_per_period": COUNTS_PER_PERIOD,
    "position_source": 1,
    "drive": 2,
    "disagreement_limit": 0,
    "encoder_fault_mask": 1,  # an illegal transition of A/B is a fault, because counts are lost
    "deglitch": "1us",
    "velocity_quantum": "1um",
    "travel_low": "-6mm",
    "travel_high": "6mm",
    "following_limit": "1mm",
    "velocity": "50mm/s",
    "acceleration": "2m/s2",
    "jerk": "200m/s3",
    "home_method": -2,
    "home_distance": "1.2mm",
    "homing_search_speed": "25mm/s",
    "homing_latch_speed": "10mm/s",
    "settle_window": "0.5um",
    "settle_time": "20ms",
    "dead_band": "0.5um",
    "integral_limit": 0.9,
    "output_limit": 0.97,
}


def servo(
    bandwidth_hz: float = 60.0, damping: float = 0.9, integral_share: float = 1 / 3
) -> dict[str, float]:
    """Gains for a mass on a current amplifier: the poles of the position loop are at the bandwidth,
    and mass and drag have a feed-forward.
    """
    p = parameters.values(machine="linear_motor")
    # force of one count of the command
    newton = p["motor_constant"] * p["amplifier_gain"] * p["amplifier_reference"] / FULL_SCALE
    inertia = p["mover_mass"] * POSITION_LSB_M * TICK_HZ**2 / newton  # command / (LSB/tick2)
    drag = p["guide_viscous"] * POSITION_LSB_M * TICK_HZ / newton  # command / (LSB/tick)
    omega = 2 * math.pi * bandwidth_hz / TICK_HZ
    kp = omega**2 * inertia
    return {
        "kp": kp,
        "ki": kp * omega * integral_share,
        "kd": 2 * damping * omega * inertia,
        "kv": drag,
        "ka": inertia,
    }


@dataclass(frozen=True)
class Search:
    """One search of the zero."""

    start_um: float
    directions: str  # of the motion, in their order
    time_s: float
    zero_counts: int  # count of the scale at the zero of the node
    remaining_um: float  # position of the mover after the search
    trace: Trace  # time_s, position_m


class Motor:
    """The simulated machine, its node and its host."""

    def __init__(
        self,
        seed: int = 1,
        settings: Mapping[str, Value] | None = None,
        **machine: float,
    ) -> None:
        self.twin = self.twin_of([Node(1, [Axis("linear_motor", machine)])], seed)
        self.bus = Bus(TwinTransport(self.twin), random_source=random.Random(seed), poll_s=POLL_S)
        self.twin.run_until_ready()
        self.axis = self.bus.axis(1)
        for name, value in {**SETTINGS, **servo(), **(settings or {})}.items():
            self.axis.set_parameter(name, value)

    def twin_of(self, nodes: Sequence[Node], seed: int) -> Twin:
        """The twin of the node: RTL."""
        return Twin(nodes, seed=seed, clk_hz=CLK_HZ, node_parameters=NODE)

    @property
    def position_um(self) -> float:
        """The true position of the mover."""
        return float(self.twin.truth().position_m * 1e6)

    def carry(self, position_m: float) -> None:
        """Switches the drive off and moves the mover to this position by an external force."""
        self.axis.disable()
        for _ in range(100):
            now = self.twin.truth()
            distance = position_m - now.position_m
            if abs(distance) < 20e-6:
                break
            force = 4000 * distance + math.copysign(1.1, distance) - 140 * now.velocity_m_s
            self.twin.push(0, force)
            self.twin.run(2e-3)
        self.twin.push(0, 0.0)
        self.twin.run(0.05)

    def zero_counts(self) -> int:
        """The count of the scale at the zero of the node: the true count minus the count of the
        node, both read at rest with the drive off.
        """
        self.axis.disable()
        self.twin.run(0.02)
        return int(self.twin.truth().scale_counts) - self.axis.status().counts

    def search(self, rate_hz: float = 0) -> Search:
        """Searches the zero; with a rate, the search has a trace of the machine."""
        start_um, began = self.position_um, self.bus.transport.now()
        self.twin.trace(0, rate_hz)
        self.axis.enable()
        headings: list[str] = []

        def record(status: Status) -> None:
            if abs(status.velocity_mm_s) > 1:
                heading = "up" if status.velocity_mm_s > 0 else "down"
                if heading not in headings[-1:]:
                    headings.append(heading)

        self.axis.home(progress=record)
        took, remaining_um = self.bus.transport.now() - began, self.position_um
        trace = self.twin.take_trace() if rate_hz else {}
        return Search(start_um, ", ".join(headings), took, self.zero_counts(), remaining_um, trace)


def searches(
    count: int,
    seed: int = 1,
    rate_hz: float = 0,
    done: Callable[[Search], object] | None = None,
) -> list[Search]:
    """Makes several searches: the first from the position at power-up, the others from random
    positions within RANGE_M of the mark.
    """
    motor, source = Motor(seed), random.Random(seed)
    made: list[Search] = []
    for number in range(count):
        if number:
            motor.carry(source.uniform(-RANGE_M, RANGE_M))
        made.append(motor.search(rate_hz))
        if done is not None:
            done(made[-1])
    return made


# ------------------------------------------------------------------ a mark anywhere

WIDEST = 16  # counts, four periods; the narrowest is one count


def any_mark(source: random.Random) -> dict[str, float]:
    """Parameters of a machine whose mark lies anywhere between the edges of A and B and is a
    quarter to four periods wide; the edges have a random part of all errors of a bad world.
    """
    errors = parameters.world("bad", "linear_motor")
    signs = {name: source.choice((-1, 1)) if name.endswith("_error") else 1 for name in errors}
    return {
        "scale_index_position": source.uniform(0, COUNTS_PER_PERIOD * COUNT_M),
        "scale_index_width": COUNT_M * WIDEST ** source.uniform(0, 1),
        **{name: signs[name] * source.uniform(0, bad) for name, bad in errors.items()},
    }


@dataclass(frozen=True)
class Surveyed:
    """A motor with its mark anywhere, and the zeros of its searches."""

    seed: int
    mark: Mapping[str, float]  # parameters of the machine
    survey: IndexSurvey | None  # None: the survey refused
    refusal: str  # its cause, or ""
    zeros: tuple[int, ...]  # count of the scale at each zero

    @property
    def warned(self) -> bool:
        """Whether the survey warned or refused."""
        return self.survey is None or bool(self.survey.warnings)

    @property
    def different(self) -> int:
        """Searches that found another count than most of them."""
        return len(self.zeros) - max(Counter(self.zeros).values(), default=0)


def surveyed(seed: int, count: int = 20, passes: int = PASSES) -> Surveyed:
    """Powers up a motor with its mark anywhere, surveys the mark, and searches the zero so many
    times from random positions within RANGE_M of it.
    """
    source = random.Random(seed)
    mark = any_mark(source)
    motor = Motor(seed, None, **mark)
    motor.axis.enable()
    try:
        survey, refusal = motor.axis.survey_index(passes=passes), ""
    except NotSurveyed as why:
        survey, refusal = None, why.cause
    zeros = []
    for _ in range(count if survey else 0):
        motor.carry(source.uniform(-RANGE_M, RANGE_M))
        zeros.append(motor.search().zero_counts)
    return Surveyed(seed, mark, survey, refusal, tuple(zeros))


def zero_spread(made: Sequence[Search]) -> int:
    """The largest difference between the zeros of these searches, in counts."""
    zeros = [search.zero_counts for search in made]
    return max(zeros) - min(zeros)


# ------------------------------------------------------------------ the experiment

LEFT_OUT = (
    "a mark near an edge of A or B, where one count more or less is found; noise on the levels, "
    "temperature"
)

HEAD = (
    "search",
    "started at / \N{MICRO SIGN}m",
    "side of the mark",
    "directions",
    "time / s",
    "zero, count of the scale",
    "mover at / \N{MICRO SIGN}m",
)


def rows(made: Sequence[Search]) -> list[tuple[str, ...]]:
    """The rows of the table of searches."""
    return [
        (
            str(number),
            f"{search.start_um:+.1f}",
            "above" if search.start_um > 0 else "below",
            search.directions,
            f"{search.time_s:.2f}",
            str(search.zero_counts),
            f"{search.remaining_um:+.2f}",
        )
        for number, search in enumerate(made, 1)
    ]


def pictures(made: Sequence[Search]) -> str:
    """The picture of the searches, as HTML."""
    figure, (motions, zeros) = report.drawing(height=4.2, ncols=2)
    for number, search in enumerate(made):
        motions.plot(
            search.trace["time_s"] - search.trace["time_s"][0],
            search.trace["position_m"] * 1e3,
            linewidth=0.9,
            color=report.colour(number),
        )
    motions.axhline(0, color="#999999", linewidth=0.8)
    motions.set(
        xlabel="time / s", ylabel="true position / mm", title="ten searches; the mark is at 0"
    )
    first = made[0].zero_counts
    zeros.plot(
        range(1, len(made) + 1),
        [search.zero_counts - first for search in made],
        linestyle="",
        marker="o",
        color=report.colour(0),
        label="zero, relative to the first",
    )
    for side in (-1, 1):
        zeros.axhline(
            side * PAPER_UM,
            color="#b00020",
            linewidth=1.2,
            linestyle="--",
            label="paper: \N{PLUS-MINUS SIGN}2 \N{MICRO SIGN}m" if side > 0 else None,
        )
    zeros.set(
        xlabel="search", ylabel="zero / \N{MICRO SIGN}m", ylim=(-3, 3), title="the zero point"
    )
    zeros.legend(frameon=False, fontsize="small")
    return picture(
        "searches",
        "Searches from random positions, and the zero that each found",
        report.png(figure),
    )


def run(
    seed: int = 1,
    count: int = SEARCHES,
    folder: Path = start_page.FOLDER,
    console: Console | None = None,
) -> tuple[list[Search], Path]:
    """Runs the whole experiment and returns the searches and the path of the report."""
    console = console or Console()
    console.print(f"[bold]S3: zero point of a linear motor[/] (seed {seed})")
    with console.status("building the twin; searching"):
        made = searches(count, seed, rate_hz=2000)
    shown = Table(*HEAD, title=f"{count} searches from positions of rest")
    for row in rows(made):
        shown.add_row(*row)
    console.print(shown)
    spread = zero_spread(made)
    # not compared: the mark of this model keeps clear of the edges of A and B
    compared = [
        report.Compared(
            "zero point in repeated searches",
            "within \N{PLUS-MINUS SIGN}2 \N{MICRO SIGN}m",
            f"spread of {spread * COUNT_M * 1e6:g} \N{MICRO SIGN}m",
        ),
        report.Compared(
            "longest search", "not given", f"{max(search.time_s for search in made):.2f} s"
        ),
    ]
    text = text_of(
        "S3: zero point of a linear motor",
        "The machine has a voice coil, a current amplifier with a 16-bit DAC, and a scale of 1 "
        "\N{MICRO SIGN}m with a reference mark. The simulation runs the same RTL and firmware as "
        "the FPGA, with a model of the machine. The zero is measured by the count of the scale of "
        "the model, which no controller can see.",
        [
            report.against_the_paper(compared, LEFT_OUT),
            pictures(made),
            report.table(HEAD, rows(made), text_columns=1),
        ],
        {
            "again": f"build/venv/bin/python -m experiments.s3_zero --seed {seed} "
            f"--searches {count}",
        },
        claim=f"{count} searches from random positions found zeros that are {spread} counts of "
        "1 \N{MICRO SIGN}m apart; the paper's real motor stayed within \N{PLUS-MINUS SIGN}2 "
        "\N{MICRO SIGN}m.",
        left_out=LEFT_OUT,
    )
    path = start_page.publish("s3_zero", text, folder)
    console.print(
        f"spread of the zero: {spread} counts (the paper's real motor: within "
        "\N{PLUS-MINUS SIGN}2 \N{MICRO SIGN}m)"
    )
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return made, path


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment from the command line and returns the exit code."""
    parser = command.parser_of(
        "s3_zero", "S3 in the twin: it searches the zero and writes a report.", "the positions"
    )
    command.add_number(parser, "--searches", "searches", SEARCHES)
    asked = parser.parse_args(arguments)
    return command.exit_code("s3_zero", lambda: run(asked.seed, asked.searches, asked.report))


if __name__ == "__main__":
    sys.exit(main())

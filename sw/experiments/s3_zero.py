# SPDX-License-Identifier: Apache-2.0
"""S3: the zero point of a linear motor, searched from wherever it rests.

    python -m experiments.s3_zero

Powers one node up with a voice coil on a current amplifier behind a 16-bit converter, a 1 um scale
and its reference mark. Ten times the
drive is off, the mover left anywhere within 1 mm of the mark, and the zero searched (home_method
-2): up, and if the mark is not there
down; the count at its rising edge is captured in hardware, always going up. Writes
build/report/s3.html. The paper's zero lay
within +-2 um.
"""

import argparse
import math
import random
import sys
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from experiments.report_page import ROOT, page, picture
from moire.analysis import report
from moire.client.bus import Bus
from moire.errors import MoireError
from twin import START_S, BuildError, Twin, TwinTransport
from twin.nodes.twin import Axis, Node, drives
from twin.parameters import tables as parameters

CLK_HZ = 1_600_000  # enough for a count in 20 clk at the top speed
NODE = {**drives("HAS_DAC"), "FILTERS": 0, "HAS_SINE": 0}
POLL_S = 0.01  # between two looks at a search
SEARCHES = 10  # of the paper's table 1
RANGE_M = 1e-3  # the mover rests this near to the mark
COUNT_M = 1e-6
COUNTS_PER_PERIOD = 4
PAPER_UM = 2.0
TICK_HZ = 4000
POSITION_LSB_M = COUNTS_PER_PERIOD * COUNT_M / 65536
FULL_SCALE = 32768  # of a command, and of kp, kd, kv; ki and ka have their own

SETTINGS = {
    "period": "4um",
    "counts_per_period": COUNTS_PER_PERIOD,
    "position_source": 1,
    "drive": 2,
    "disagreement_limit": 0,
    "encoder_fault_mask": 1,  # an illegal edge of A/B is a fault: counts would be lost
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


def servo(bandwidth_hz=60.0, damping=0.9, integral_share=1 / 3):
    """Gains for a mass on a current amplifier: poles of the position loop at the bandwidth,
    feed-forward of mass and drag.
    """
    p = parameters.values(machine="linear_motor")
    newton = (
        p["motor_constant"] * p["amplifier_gain"] * p["amplifier_reference"] / FULL_SCALE
    )  # a count of command
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
    start_um: float
    ways: str  # directions in which it went
    time_s: float
    zero_counts: int  # count of the scale at which the node's zero lies
    remaining_um: float  # where the mover ended
    trace: dict  # time_s, position_m


class Motor:
    """The simulated machine, its node, and the host that talks to it."""

    def __init__(self, seed=1, settings=None, **machine):
        self.twin = Twin(
            [Node(1, [Axis("linear_motor", machine)])],
            seed=seed,
            clk_hz=CLK_HZ,
            node_parameters=NODE,
        )
        self.bus = Bus(TwinTransport(self.twin), random_source=random.Random(seed), poll_s=POLL_S)
        self.bus.transport.wait(START_S)
        self.axis = self.bus.axis(1)
        for name, value in {**SETTINGS, **servo(), **(settings or {})}.items():
            self.axis.set_parameter(name, value)

    @property
    def position_um(self):
        return self.twin.truth().position_m * 1e6

    def carry(self, place_m):
        """A hand moves the mover while the drive is off, and lets go."""
        self.axis.disable()
        for _ in range(100):
            now = self.twin.truth()
            way = place_m - now.position_m
            if abs(way) < 20e-6:
                break
            self.twin.push(0, 4000 * way + math.copysign(1.1, way) - 140 * now.velocity_m_s)
            self.twin.run(2e-3)
        self.twin.push(0, 0.0)
        self.twin.run(0.05)

    def zero_counts(self):
        """Judged with the drive off, when nothing moves any more: the machine's count less the
        node's.
        """
        self.axis.disable()
        self.twin.run(0.02)
        return self.twin.truth().scale_counts - self.axis.status().counts

    def search(self, rate_hz=0):
        start_um, began = self.position_um, self.bus.transport.now()
        self.twin.trace(0, rate_hz)
        self.axis.enable()
        headings = []

        def look(status):
            if abs(status.velocity_mm_s) > 1:
                heading = "up" if status.velocity_mm_s > 0 else "down"
                if heading not in headings[-1:]:
                    headings.append(heading)

        self.axis.home(progress=look)
        took, remaining_um, trace = (
            self.bus.transport.now() - began,
            self.position_um,
            self.twin.take_trace() if rate_hz else {},
        )
        return Search(start_um, ", ".join(headings), took, self.zero_counts(), remaining_um, trace)


def searches(count, seed=1, rate_hz=0, done=None):
    """The first from where the mover was at power-up, each next one from a random place within
    RANGE_M of the mark.
    """
    motor, source, made = Motor(seed), random.Random(seed), []
    for number in range(count):
        if number:
            motor.carry(source.uniform(-RANGE_M, RANGE_M))
        made.append(motor.search(rate_hz))
        if done is not None:
            done(made[-1])
    return made


def zero_spread(made):
    zeros = [search.zero_counts for search in made]
    return max(zeros) - min(zeros)


# ------------------------------------------------------------------ the experiment

HEAD = (
    "search",
    "started at / um",
    "side of the mark",
    "went",
    "time / s",
    "zero, count of the scale",
    "mover at / um",
)


def rows(made):
    return [
        (
            str(number),
            f"{search.start_um:+.1f}",
            "above" if search.start_um > 0 else "below",
            search.ways,
            f"{search.time_s:.2f}",
            str(search.zero_counts),
            f"{search.remaining_um:+.2f}",
        )
        for number, search in enumerate(made, 1)
    ]


def pictures(made):
    figure, (ways, zeros) = report.drawing(height=4.2, ncols=2)
    for number, search in enumerate(made):
        ways.plot(
            search.trace["time_s"] - search.trace["time_s"][0],
            search.trace["position_m"] * 1e3,
            linewidth=0.9,
            color=report.colour(number),
        )
    ways.axhline(0, color="#999999", linewidth=0.8)
    ways.set(xlabel="time / s", ylabel="true position / mm", title="ten searches; the mark is at 0")
    first = made[0].zero_counts
    zeros.plot(
        range(1, len(made) + 1),
        [search.zero_counts - first for search in made],
        linestyle="",
        marker="o",
        color=report.colour(0),
        label="zero, of the first",
    )
    for side in (-1, 1):
        zeros.axhline(
            side * PAPER_UM,
            color="#b00020",
            linewidth=1.2,
            linestyle="--",
            label="paper: \N{PLUS-MINUS SIGN}2 um" if side > 0 else None,
        )
    zeros.set(xlabel="search", ylabel="zero / um", ylim=(-3, 3), title="the zero point")
    zeros.legend(frameon=False, fontsize="small")
    return picture(
        "searches", "Searches from random rest, and where each found its zero", report.png(figure)
    )


def run(seed=1, count=SEARCHES, path=ROOT / "build" / "report" / "s3.html", console=None):
    console = console or Console()
    console.print(f"[bold]S3: zero point of a linear motor[/] (seed {seed})")
    with console.status("building the twin; searching"):
        made = searches(count, seed, rate_hz=2000)
    shown = Table(*HEAD, title=f"{count} searches from free rest")
    for row in rows(made):
        shown.add_row(*row)
    console.print(shown)
    spread = zero_spread(made)
    compared = [
        (
            "spread of the zero point",
            "\N{PLUS-MINUS SIGN}2 um",
            f"{spread * COUNT_M * 1e6:g} um",
            report.verdict(spread == 0),
        ),
        (
            "longest search",
            "not given",
            f"{max(search.time_s for search in made):.2f} s",
            report.verdict(None),
        ),
    ]
    path = page(
        path,
        "S3: zero point of a linear motor",
        "A voice coil on a current amplifier, set by a 16-bit converter; a scale of 1 um with a reference mark. Simulated from the "
        "very RTL and firmware that go into the FPGA, closed around a model of the machine. The zero is judged by the count of the "
        "model's scale, which no controller sees.",
        [
            report.table(("", "paper", "here", ""), compared),
            pictures(made),
            report.table(HEAD, rows(made), text_columns=1),
        ],
        {"again": f"build/venv/bin/python -m experiments.s3_zero --seed {seed} --searches {count}"},
    )
    console.print(f"spread of the zero: {spread} counts (paper: within +-2 um)")
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return made, path


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m experiments.s3_zero", description="S3 in the twin: search the zero, report."
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the machine and of the places (default 1)"
    )
    parser.add_argument(
        "--searches", type=int, default=SEARCHES, help=f"1 to 10000 (default {SEARCHES})"
    )
    options = parser.parse_args(arguments)
    if not 1 <= options.searches <= 10000:
        parser.error(f"--searches takes 1 to 10000, not {options.searches}")
    try:
        run(options.seed, options.searches)
    except (MoireError, BuildError) as error:
        print(f"s3_zero: {error}", file=sys.stderr)
        return getattr(error, "exit_code", 1)
    except KeyboardInterrupt:
        print("s3_zero: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

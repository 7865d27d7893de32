# SPDX-License-Identifier: Apache-2.0
"""Figures of the speed of the twin: simulated time per time of one core, and how it depends on the
number of axes.
"""

import statistics
import time
from collections.abc import Sequence

from experiments import s2_stage
from figures.common import Figure, Quick, console
from moire.bus.protocol import MOST_AXES
from twin import Axis, Node, Twin, realtime_factor
from twin.nodes.twin import CLK_HZ

GROWTH_CLK_HZ = 12_000_000  # a servo tick has the cycles for all axes
STARTED_S = 0.6  # simulated, until the soft core waits: the node with most axes starts longest
ROUNDS = 5


def twin_realtime(simulated_s: float = 0.5) -> float:
    console.print(f"CLK_HZ {CLK_HZ}, two nodes and their machines, one core")
    return realtime_factor(simulated_s)


def cycle_times_ns(axes: Sequence[int], cycles: int, rounds: int, started_s: float) -> list[float]:
    """The time of one core for a cycle of a node with each of these numbers of axes, started_s
    after reset: the least of several rounds, in which the nodes take turns.
    """
    twins = [
        Twin(
            [Node(1, [Axis("stepper_stage")] * count)],
            clk_hz=GROWTH_CLK_HZ,
            node_parameters=s2_stage.NODE,
        )
        for count in axes
    ]
    for twin in twins:
        twin.run(started_s)
    took: list[list[float]] = [[] for _ in twins]
    for _ in range(rounds):
        for twin, times in zip(twins, took):
            began = time.process_time()
            twin.run(cycles / twin.clk_hz)
            times.append((time.process_time() - began) / cycles * 1e9)
    for count, times in zip(axes, took):
        console.print(
            f"{count} {'axis' if count == 1 else 'axes'}: {min(times):.0f} ns per cycle, "
            f"median {statistics.median(times):.0f} ns"
        )
    return [min(times) for times in took]


def growth_twin(
    cycles: int = 1_000_000,
    rounds: int = ROUNDS,
    axes: int = MOST_AXES,
    started_s: float = STARTED_S,
) -> float:
    one, most = cycle_times_ns((1, axes), cycles, rounds, started_s)
    return most / one


FIGURES = {
    "twin_realtime": Figure(
        twin_realtime,
        "s/s",
        "simulated seconds per second of one core, two nodes and their machines, drives off, "
        f"CLK_HZ = {CLK_HZ / 1e6:g} MHz, best of five",
        ">= 1.0",
        Quick({"simulated_s": 0.05}, "0.05 s each", "> 0.05"),
        2,
    ),
    "growth_twin": Figure(
        growth_twin,
        "",
        f"time of one core for a cycle of a node with {MOST_AXES} step axes and their machines, "
        f"divided by the time with one axis; drives off, from {STARTED_S} s after power-up on, "
        "when both soft cores wait",
        "<= 2.5",
        Quick(
            {"cycles": 100_000, "rounds": 2, "axes": 2, "started_s": 0.1},
            "10^5 cycles each, two axes",
            "",
        ),
        2,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figures of streams: the compiled firmware plays a path whose set-points come irregularly, get
lost, overtake each other or come twice.

The player is that of twin.compiled.axis, which adds up the pieces as they are pushed; so its target
jumps wherever the pieces do.
"""

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from figures.common import Figure, Quick, console
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, PARAMETER, PERIOD

CYCLES = 1_000_000
CLK_HZ = 60_000_000
TICK_HZ = 4000
CYCLE_TICKS = 16  # between two set-points
AHEAD = 4  # cycles that a set-point is sent before the tick of the one before
LATE_LIMIT = 100  # ticks
FAR = 4000  # periods: the largest distance of a part of the path
LOST, BURST, OVERTAKEN, TWICE = 0.01, 0.001, 0.01, 0.01  # shares of the set-points
BURST_LENGTH = 5
ONE = 1 << 40  # a period in the player
VELOCITY, ACCELERATION = (
    PARAMETER[name]["default"] * ONE / TICK_HZ**power
    for power, name in enumerate(("velocity", "acceleration"), start=1)
)
ALLOWED = 1 + 2**-10  # of the limits, as docs/stream.md says
ROUNDED = 1 << 24  # an LSB of the position, to which the end of a motion is rounded


class Node(CompiledNode):
    """A node of 60 MHz whose targets are judged in every tick."""

    def __init__(self) -> None:
        self.jumps = 0
        self.before = (0, 0)  # target and step of the last tick
        super().__init__(Axis(), image="stream")
        far = 1_000_000 * PERIOD
        self.set(travel_low=-far, travel_high=far, home_method=35, position_source=1)
        self.ask("enable", axis=0, on=1)
        self.ask("home", axis=0)
        while self.status()["ended"] == "running":
            self.millisecond()
        self.before = self.axes[0].player.target, 0
        self.jumps = 0

    def read(self, offset: int) -> int:
        """A register; the clock is faster than usual."""
        return CLK_HZ if offset == DEFINES["NODE_CLK_HZ"] else super().read(offset)

    def millisecond(self) -> None:
        """Four ticks and a poll."""
        axis = self.axes[0]
        for _ in range(TICK_HZ // 1000):
            axis.tick()
            target, step = self.before
            new = axis.player.target - target
            beyond = (
                abs(new) > VELOCITY * ALLOWED + ROUNDED
                or abs(new - step) > ACCELERATION * ALLOWED + ROUNDED
            )
            self.jumps += beyond
            self.before = axis.player.target, new
        self.clk += CLK_HZ // 1000
        self.poll()


@dataclass
class Outcome:
    """What has happened in all streams."""

    cycles: int = 0
    jumps: int = 0
    unreported: int = 0
    ended: Counter[str] = field(default_factory=Counter)
    replies: Counter[str] = field(default_factory=Counter)


def path(draw: random.Random, position: float) -> Iterator[tuple[float, float]]:
    """Position and velocity in periods and periods per tick at each set-point, from rest: parts
    without a jump of the acceleration, within 0.8 of the velocity and 0.6 of the acceleration.
    """
    while True:
        distance = draw.uniform(-FAR, FAR)
        ticks = max(
            1.875 * abs(distance) / (0.8 * VELOCITY / ONE),
            (5.78 * abs(distance) / (0.6 * ACCELERATION / ONE)) ** 0.5,
            CYCLE_TICKS,
        )
        count = -(-int(ticks + 1) // CYCLE_TICKS)
        for n in range(1, count + 1):
            s = n / count
            yield (
                position + distance * s**3 * (10 - 15 * s + 6 * s * s),
                distance * 30 * (s * (1 - s)) ** 2 / (count * CYCLE_TICKS),
            )
        position += distance


def disturbed(draw: random.Random, count: int) -> list[tuple[float, int]]:
    """(millisecond, number) of each set-point that arrives, in the order in which they do."""
    cycle_ms = CYCLE_TICKS * 1000 // TICK_HZ
    arrived, burst = [], 0
    for n in range(count):
        burst = BURST_LENGTH if draw.random() < BURST else max(0, burst - 1)
        if burst or draw.random() < LOST:
            continue
        at = cycle_ms * (n - AHEAD + draw.uniform(-0.3, 0.3))
        arrived.append((at + cycle_ms * 1.4 * (draw.random() < OVERTAKEN), n))
        if draw.random() < TWICE:
            arrived.append((at + cycle_ms * draw.uniform(0, 2), n))
    return sorted(arrived)


def stream(draw: random.Random, node: Node, most: int, outcome: Outcome) -> None:
    """Plays one stream until it ends, at most so many set-points."""
    begin = node.axes[0].target / PERIOD
    source = path(draw, begin)
    points = [next(source) for _ in range(most)]
    node.ask("begin_stream", axis=0, late_limit=LATE_LIMIT)
    replies: Counter[str] = Counter()
    started, now = False, 0.0
    arrivals = disturbed(draw, most)
    reached = 0
    sent = 0
    for at, n in arrivals:
        if at > 0 and not started:
            node.ask("start", axes=1)
            started = True
        while started and now < at:
            node.millisecond()
            now += 1
        position, velocity = points[n]
        cause, _ = node.request(
            "set_point",
            axis=0,
            last=0,
            tick=CYCLE_TICKS * (n + 1),
            position=round(position * PERIOD),
            velocity=round(velocity * ONE),
        )
        sent += 1
        replies[cause] += 1
        reached = max(reached, n + 1)
        if cause == "no_stream":
            break
    while node.status()["ended"] == "running":
        node.millisecond()
    ended = node.status()["ended"]
    state = node.ask("stream", axis=0)
    lost = reached - len({n for _, n in arrivals[:sent]})  # or behind the end of the stream
    known = state["accepted"] + state["late"] + replies["set_point_limits"] + replies["no_stream"]
    outcome.unreported += abs(sent - known) + (ended != "set_point_late")
    outcome.unreported += (state["accepted"], state["late"]) != (
        replies["ok"],
        replies["set_point_late"],
    )
    outcome.cycles += reached
    outcome.ended[ended] += 1
    outcome.replies += replies + Counter(lost=lost)


@cache
def outcome_of(cycles: int, seed: int) -> Outcome:
    """So many cycles at least. A stream ends when its set-points are over, or it is too late."""
    draw, outcome, node = random.Random(seed), Outcome(), Node()
    while outcome.cycles < cycles:
        stream(draw, node, min(2000, cycles - outcome.cycles + 100), outcome)
        outcome.jumps = node.jumps
        if node.axes[0].faults:
            raise RuntimeError(f"a fault ended a stream: {node.axes[0].faults:#x}")
    words = ", ".join(f"{name} {count}" for name, count in sorted(outcome.replies.items()))
    console.print(f"{outcome.cycles} cycles, {outcome.ended.total()} streams; {words}")
    return outcome


def stream_jumps(cycles: int = CYCLES, seed: int = 1) -> int:
    """Ticks beyond the limits."""
    return outcome_of(cycles, seed).jumps


def stream_late_unreported(cycles: int = CYCLES, seed: int = 1) -> int:
    """Set-points of which nobody learns."""
    return outcome_of(cycles, seed).unreported


RUN = (
    f"cycles of 4 ms with jitter of 30 %, {LOST:.0%} lost, bursts of {BURST_LENGTH} lost, "
    f"{OVERTAKEN:.0%} overtaken, {TWICE:.0%} twice"
)
SHORT = Quick({"cycles": 2000}, "2000 cycles")
FIGURES = {
    "stream_jumps": Figure(
        stream_jumps,
        "ticks",
        f"compiled firmware, {CYCLES} {RUN}: servo ticks at which the target of a stream, or of "
        "the stop after it, goes beyond the limits of velocity or acceleration",
        "0",
        SHORT,
        0,
    ),
    "stream_late_unreported": Figure(
        stream_late_unreported,
        "set-points",
        "the same run: late or lost set-points that neither a counter nor a refusal shows, and "
        "streams that end without naming lateness",
        "0",
        SHORT,
        0,
    ),
}

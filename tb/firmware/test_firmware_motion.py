# SPDX-License-Identifier: Apache-2.0
"""motion.c and its use by axis.c: short queues, change of target, feed override, fine stage."""

import random

import pytest

from tb.bench import seed
from tb.firmware.plan_model import limits, steps
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, PARAMETER, PERIOD

TRAVEL = {
    "travel_low": -5000 * PERIOD,
    "travel_high": 20_000 * PERIOD,
    "home_method": 37,
    "position_source": 1,
}
FINE = DEFINES["AXIS_CONTROL_FINE_MASK"]
CLOSED_LOOP = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"]
ENABLE = DEFINES["AXIS_CONTROL_ENABLE_MASK"]


def homed(axes=1, **parameters):
    machine = CompiledNode(*(Axis() for _ in range(axes)))
    for n in range(axes):
        machine.set(axis=n, **{**TRAVEL, **parameters})
        machine.ask("enable", axis=n, on=1)
        machine.ask("home", axis=n)
    assert machine.run(
        1000, until=lambda: all(machine.status(n)["ended"] == "ok" for n in range(axes))
    )
    return machine


def finish(machine, axis=0, ms=20_000):
    assert machine.run(ms, until=lambda: machine.status(axis)["ended"] != "running"), (
        "the motion does not end"
    )
    return machine.status(axis)["ended"]


# feeding


def test_the_queue_lasts_16_ms_and_150_000_cycles_and_a_piece():
    machine = homed()
    axis = machine.axes[0]
    axis.pushed = []
    ticks = machine.ask("move", axis=0, target=3000 * PERIOD)["duration_ticks"]
    queued, asked = [], 4 * (16 + 37.5)  # ticks
    while machine.status()["state"] == "moving":
        machine.run(1)
        if not axis.pushed[-1][4]:  # more is left of the plan
            queued.append(sum(segment[3] for segment in axis.player.queue))
    assert asked - 16 < min(queued) and max(queued) < asked + 128
    lengths = [segment[3] for segment in axis.pushed]
    assert sum(lengths) == ticks and max(lengths) <= 128
    assert [segment[4] for segment in axis.pushed] == [0] * (len(axis.pushed) - 1) + [1]


def test_a_busy_soft_core_does_not_starve_a_short_move():
    """The events of a short move are a tick apart, and its queue has room for 16 segments. The
    firmware feeds them only every 10 ms, which is four times as rarely as at 60 MHz.
    """
    machine = homed()
    axis, target = machine.axes[0], 0
    for step in (*range(50, 4000, 350), 9000, 22_000, PERIOD, 3 * PERIOD):
        target += step
        machine.ask("move", axis=0, target=target)
        for _ in range(500):
            if not axis.player.moving:
                break
            for _ in range(40):
                axis.tick()
            machine.poll()
        assert axis.faults == 0 and axis.target == target, f"a move of {step}"
        assert finish(machine) == "ok"


@pytest.mark.parametrize("flipped", [1, 1 << 16, -(1 << 17)])
def test_a_motion_whose_target_is_wrong_at_its_end_is_reported(flipped):
    machine = homed(settle_time=50)
    axis = machine.axes[0]
    machine.ask("move", axis=0, target=100 * PERIOD)
    assert machine.run(2000, until=lambda: machine.status()["state"] == "settling")
    axis.player.target += flipped << 24
    assert finish(machine) == "not_settled"
    machine.ask("move", axis=0, target=0)
    assert finish(machine) == "ok" and axis.target == 0


def test_requests_and_the_time_of_the_watchdog_are_written_in_each_round():
    machine = homed(watchdog_time=70)
    axis, time = machine.axes[0], DEFINES["BUS_BASE"] + DEFINES["BUS_WATCHDOG_TIME"]
    right = axis.control
    assert right & ENABLE and machine.word[time] == 70
    for bit in range(16):
        axis.word[DEFINES["AXIS_CONTROL"]] ^= 1 << bit
        machine.word[time] ^= 1 << bit
        machine.poll()
        assert axis.control == right and machine.word[time] == 70


# another target in flight


@pytest.mark.parametrize("second", [9000, 200, 100, -2000, 0, 7000])
@pytest.mark.parametrize("after_ms", [1, 60, 140, 300])
def test_a_move_in_motion_continues_to_the_new_target(second, after_ms):
    machine = homed()
    machine.ask("move", axis=0, target=8000 * PERIOD)
    machine.run(after_ms)
    assert machine.ask("move", axis=0, target=second * PERIOD + 7) == {"duration_ticks": 0}
    assert (
        finish(machine) == "ok"
        and machine.axes[0].target == second * PERIOD + 7
        and machine.axes[0].faults == 0
    )


def test_targets_that_change_all_the_time_end_at_the_last_accepted_one():
    draw, machine, taken = random.Random(seed()), homed(), 0
    for _ in range(12):
        target = draw.randrange(-4000 * PERIOD, 9000 * PERIOD)
        machine.ask("move", axis=0, target=target)
        for _ in range(draw.randrange(6)):
            machine.run(draw.randrange(1, 200))
            another = draw.randrange(-4000 * PERIOD, 9000 * PERIOD)
            cause = machine.request("move", axis=0, target=another)[0]
            assert cause in ("ok", "busy")  # busy: its last piece is queued
            taken += cause == "ok"
            target = another if cause == "ok" else target
        assert (
            finish(machine) == "ok"
            and machine.axes[0].target == target
            and machine.axes[0].faults == 0
        )
    assert taken > 5


def test_a_move_that_settles_gives_way_to_the_next_one():
    machine = homed(settle_time=1000)
    machine.ask("move", axis=0, target=PERIOD)
    assert machine.run(2000, until=lambda: machine.status()["state"] == "settling")
    machine.ask("move", axis=0, target=9 * PERIOD)
    assert (
        machine.status()["state"] == "moving"
        and finish(machine) == "ok"
        and machine.axes[0].target == 9 * PERIOD
    )


# override


@pytest.mark.parametrize("jerk", [10**6, 12_500_000, 10**9])
def test_a_change_of_the_override_adds_no_more_than_a_quarter_of_acceleration_and_jerk(jerk):
    machine = homed(jerk=jerk)
    machine.ask("move", axis=0, target=3000 * PERIOD)
    machine.set(feed_override=32768)
    word = machine.axes[0].word
    assert word[DEFINES["AXIS_FEED_OVERRIDE"]] == 32768
    slope, curve = (
        word[DEFINES["AXIS_FEED_OVERRIDE_SLOPE"]] / 2**32 * 4000,
        word[DEFINES["AXIS_FEED_OVERRIDE_CURVE"]] / 2**32 * 4000**2,
    )
    velocity, acceleration = (PARAMETER[name]["default"] for name in ("velocity", "acceleration"))
    of_acceleration, of_jerk = (
        velocity * slope / acceleration,
        (3 * acceleration * slope + velocity * curve) / jerk,
    )
    assert max(of_acceleration, of_jerk) <= 0.25 and (of_acceleration > 0.2499 or of_jerk > 0.2499)


# profiles


def played_steps(axis):
    """The step of each tick, 2^-40 period, of all pieces pushed."""
    return [
        step
        for velocity, acceleration, jerk, ticks, _ in axis.pushed
        for step in steps([(velocity, acceleration, jerk, ticks)])
    ]


def test_a_trapezoid_has_full_acceleration_within_three_ticks_and_stops_without_limit_of_jerk():
    machine = homed(profile=1)
    axis = machine.axes[0]
    axis.pushed = []
    ticks = machine.ask("move", axis=0, target=700 * PERIOD)["duration_ticks"]
    assert finish(machine) == "ok" and axis.target == 700 * PERIOD
    velocity, acceleration, _ = limits(
        *(PARAMETER[name]["default"] for name in ("velocity", "acceleration", "jerk"))
    )
    every = [0, *played_steps(axis), 0]
    slopes = [b - a for a, b in zip(every, every[1:])]
    assert (
        max(map(abs, slopes)) <= acceleration
        and max(every) <= velocity
        and slopes[4] > 0.99 * acceleration
    )
    assert ticks <= (700 << 40) / velocity + velocity / acceleration + 4 + 1e-3 * len(every)
    assert axis.word[DEFINES["AXIS_STOP_JERK"]] == 0
    machine.set(profile=0)
    assert axis.word[DEFINES["AXIS_STOP_JERK"]] == limits(1, 1, PARAMETER["jerk"]["default"])[2]


@pytest.mark.parametrize("border_3, sections", [(32768, (400, 1200)), (21846, (400, 800))])
def test_a_stepped_profile_rises_as_in_s4_and_falls_as_its_mirror(border_3, sections):
    """f0 = 50, top 2450, rises of 50, 100, 200 period/s every 20 ms; sections 2 and 3 begin at 1/6
    and 1/2, or 1/3, of the climb.
    """
    rates = {"first": 50, "rise_1": 50, "rise_2": 100, "rise_3": 200}
    machine = homed(
        profile=2,
        velocity=2450,
        stepped_border_3=border_3,
        **{f"stepped_{name}": rate * 65536 for name, rate in rates.items()},
    )
    axis = machine.axes[0]
    axis.pushed = []
    machine.ask("move", axis=0, target=3000 * PERIOD)
    assert finish(machine) == "ok" and axis.target == 3000 * PERIOD
    every = played_steps(axis)[1:]  # the first is from rest
    climb = [round(step * 4000 / 2**40) for step in every[: len(every) // 2 : 80]]
    levels = [50]
    while levels[-1] < 2450:
        levels.append(
            levels[-1]
            + (
                50
                if levels[-1] < 50 + sections[0]
                else 100
                if levels[-1] < 50 + sections[1]
                else 200
            )
        )
    levels = [step for step in levels if step <= 2450]
    assert climb[: len(levels) - 1] == levels[:-1]
    assert all(len(set(every[n : n + 80])) == 1 for n in range(0, 80 * (len(levels) - 1), 80))
    down = every[::-1]
    assert [round(step * 4000 / 2**40) for step in down[: 80 * (len(levels) - 1) : 80]] == levels[
        :-1
    ]
    assert all(piece[1:3] == (0, 0) for piece in axis.pushed)


def test_a_stepped_profile_continues_to_its_target():
    machine = homed(profile=2, velocity=2450)
    machine.ask("move", axis=0, target=3000 * PERIOD)
    machine.run(100)
    assert machine.request("move", axis=0, target=100 * PERIOD)[0] == "busy"
    assert (
        machine.request("set_parameter", axis=0, parameter=PARAMETER["profile"]["id"], value=0)[0]
        == "busy"
    )
    assert finish(machine) == "ok" and machine.axes[0].target == 3000 * PERIOD


def test_a_short_stepped_profile_and_a_low_velocity_keep_their_speed():
    machine = homed(profile=2, velocity=2450)
    axis = machine.axes[0]
    for velocity, distance in ((2450, PERIOD // 4), (5, 3 * PERIOD)):
        machine.set(velocity=velocity)
        axis.pushed = []
        machine.ask("move", axis=0, target=axis.target + distance)
        assert finish(machine) == "ok"
        every = played_steps(axis)[1:]
        assert max(every) - min(every) <= 1 and max(every) <= min(12.5, velocity) * 2**40 / 4000


@pytest.mark.parametrize(
    "wrong",
    [{"stepped_border_2": 40_000}, {"stepped_rise_1": 1, "stepped_rise_2": 1, "stepped_rise_3": 1}],
)
def test_an_invalid_stepped_profile_is_refused_with_its_cause(wrong):
    machine = homed(profile=2, velocity=2450, **wrong)
    assert machine.request("move", axis=0, target=15_000 * PERIOD)[0] == "stepped_profile_invalid"
    machine.set(profile=0)
    machine.ask("move", axis=0, target=15_000 * PERIOD)
    assert finish(machine) == "ok"


# fine stage


def test_the_fine_stage_takes_over_within_its_reach_and_is_off_in_motion():
    machine = homed(fine_reach=PERIOD // 10)
    axis = machine.axes[0]
    machine.run(20)
    assert axis.control == ENABLE | FINE
    machine.ask("move", axis=0, target=500 * PERIOD)
    assert axis.control == ENABLE | CLOSED_LOOP
    assert finish(machine) == "ok" and axis.control == ENABLE | FINE
    axis.machine += PERIOD // 5  # it holds inside four times the reach, and releases beyond
    axis.seized = True
    machine.run(30)
    assert axis.control == ENABLE | FINE
    axis.machine += PERIOD
    machine.run(2)
    assert axis.control == ENABLE | CLOSED_LOOP
    machine.ask("enable", axis=0, on=0)
    assert axis.control == 0

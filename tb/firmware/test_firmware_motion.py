# SPDX-License-Identifier: Apache-2.0
"""motion.c and what axis.c makes of it: pieces kept short, another target in flight, override, fine stage."""
import random

import pytest

from bench import seed
from fake_machine import DEFINES, PARAMETER, PERIOD, Axis, Machine

TRAVEL = {"travel_low": -5000 * PERIOD, "travel_high": 20_000 * PERIOD, "home_method": 37, "position_source": 1}
FINE = DEFINES["AXIS_CONTROL_FINE_MASK"]
CLOSED_LOOP = DEFINES["AXIS_CONTROL_CLOSED_LOOP_MASK"]
ENABLE = DEFINES["AXIS_CONTROL_ENABLE_MASK"]


def homed(axes=1, **parameters):
    machine = Machine(*(Axis() for _ in range(axes)))
    for n in range(axes):
        machine.set(axis=n, **{**TRAVEL, **parameters})
        machine.ask("enable", axis=n, on=1)
        machine.ask("home", axis=n)
    assert machine.run(1000, until=lambda: all(machine.status(n)["ended"] == "ok" for n in range(axes)))
    return machine


def finish(machine, axis=0, ms=20_000):
    assert machine.run(ms, until=lambda: machine.status(axis)["ended"] != "running"), "the motion does not end"
    return machine.status(axis)["ended"]


# feeding

def test_what_is_queued_lasts_16_ms_and_900_000_clk_and_a_piece():
    machine = homed()
    axis = machine.axes[0]
    axis.pushed = []
    ticks = machine.ask("move", axis=0, target=3000 * PERIOD)["duration_ticks"]
    most = 0
    while machine.status()["state"] == "moving":
        machine.run(1)
        most = max(most, sum(segment[3] for segment in axis.player.queue))
    assert 4 * (16 + 225) - 16 < most < 4 * (16 + 225) + 128
    lengths = [segment[3] for segment in axis.pushed]
    assert sum(lengths) == ticks and max(lengths) <= 128
    assert [segment[4] for segment in axis.pushed] == [0] * (len(axis.pushed) - 1) + [1]


# another target in flight

@pytest.mark.parametrize("second", [9000, 200, 100, -2000, 0, 7000])
@pytest.mark.parametrize("after_ms", [1, 60, 140, 300])
def test_a_move_in_motion_goes_on_to_the_new_target(second, after_ms):
    machine = homed()
    machine.ask("move", axis=0, target=8000 * PERIOD)
    machine.run(after_ms)
    assert machine.ask("move", axis=0, target=second * PERIOD + 7) == {"duration_ticks": 0}
    assert finish(machine) == "ok" and machine.axes[0].target == second * PERIOD + 7 and machine.axes[0].faults == 0


def test_targets_that_change_all_the_time_end_at_the_last_one_taken():
    draw, machine, taken = random.Random(seed()), homed(), 0
    for _ in range(12):
        target = draw.randrange(-4000 * PERIOD, 9000 * PERIOD)
        machine.ask("move", axis=0, target=target)
        for _ in range(draw.randrange(6)):
            machine.run(draw.randrange(1, 200))
            another = draw.randrange(-4000 * PERIOD, 9000 * PERIOD)
            cause = machine.request("move", axis=0, target=another)[0]
            assert cause in ("ok", "busy")                  # busy: its last piece is queued
            taken += cause == "ok"
            target = another if cause == "ok" else target
        assert finish(machine) == "ok" and machine.axes[0].target == target and machine.axes[0].faults == 0
    assert taken > 5


def test_a_move_that_settles_gives_way_to_the_next_one():
    machine = homed(settle_time=1000)
    machine.ask("move", axis=0, target=PERIOD)
    assert machine.run(2000, until=lambda: machine.status()["state"] == "settling")
    machine.ask("move", axis=0, target=9 * PERIOD)
    assert machine.status()["state"] == "moving" and finish(machine) == "ok" and machine.axes[0].target == 9 * PERIOD


# override

def test_a_change_of_the_override_adds_no_more_than_a_quarter_of_the_acceleration():
    machine = homed()
    machine.ask("move", axis=0, target=3000 * PERIOD)
    machine.set(override=32768)
    assert machine.axes[0].word[DEFINES["AXIS_OVERRIDE"]] == 32768
    slope = machine.axes[0].word[DEFINES["AXIS_OVERRIDE_SLOPE"]]
    velocity, acceleration = (PARAMETER[name]["default"] for name in ("velocity", "acceleration"))
    assert abs(slope / 2**32 * 4000 * velocity / (acceleration / 4) - 1) < 1e-3       # a quarter of the acceleration, no more


# fine stage

def test_the_fine_stage_takes_over_within_its_reach_and_rests_in_motion():
    machine = homed(fine_reach=PERIOD // 10)
    axis = machine.axes[0]
    machine.run(20)
    assert axis.control == ENABLE | FINE
    machine.ask("move", axis=0, target=500 * PERIOD)
    assert axis.control == ENABLE | CLOSED_LOOP
    assert finish(machine) == "ok" and axis.control == ENABLE | FINE
    axis.machine += PERIOD // 5                             # inside four times the reach it stays, beyond it lets go
    axis.seized = True
    machine.run(30)
    assert axis.control == ENABLE | FINE
    axis.machine += PERIOD
    machine.run(2)
    assert axis.control == ENABLE | CLOSED_LOOP
    machine.ask("enable", axis=0, on=0)
    assert axis.control == 0

# SPDX-License-Identifier: Apache-2.0
"""main.c: how long the soft core may wait after a round, which is 0 whenever something is under way
that no word of the bus ends.
"""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import PERIOD

OFF, HOLDING = 64, 1  # ticks
LOADED_POLLS = 200  # until the calibration has loaded its first table


def idle_ticks(machine):
    return machine.firmware.firmware_idle_ticks()


@pytest.fixture
def machine():
    made = CompiledNode(Axis(), Axis(), address=1)
    made.poll(LOADED_POLLS)
    return made


def home(machine):
    for axis in (0, 1):
        machine.set(axis, home_method=37, settle_time=1)
        machine.ask("enable", axis=axis, on=1)
        machine.ask("home", axis=axis)
    assert idle_ticks(machine) == 0
    machine.run(200, until=lambda: all(machine.status(n)["ended"] == "ok" for n in (0, 1)))


def test_it_waits_while_the_drives_are_off(machine):
    assert idle_ticks(machine) == OFF


def test_it_does_not_wait_while_the_calibration_loads_its_table():
    made = CompiledNode(Axis(), address=1)
    made.poll()
    assert idle_ticks(made) == 0


def test_it_waits_for_a_tick_while_all_axes_hold_and_not_while_one_homes_or_moves(machine):
    home(machine)
    assert idle_ticks(machine) == HOLDING
    machine.ask("move", axis=1, target=20 * PERIOD)
    assert idle_ticks(machine) == 0
    assert machine.run(2000, until=lambda: machine.status(1)["ended"] == "ok")
    machine.run(100, until=lambda: idle_ticks(machine))
    assert idle_ticks(machine) == HOLDING


def test_it_does_not_wait_while_a_start_at_sync_is_due(machine):
    home(machine)
    machine.ask("prepare", axis=0, target=20 * PERIOD)
    machine.ask("start_at_sync", axes=1)
    assert idle_ticks(machine) == 0


def test_it_waits_again_after_a_start_at_sync_has_become_void(machine):
    home(machine)
    machine.ask("prepare", axis=0, target=20 * PERIOD)
    machine.ask("start_at_sync", axes=1)
    machine.ask("stop", axis=0)
    assert machine.run(100, until=lambda: idle_ticks(machine) == HOLDING)


def test_it_does_not_wait_for_a_fine_stage(machine):
    machine.set(0, fine_reach=100)
    home(machine)
    assert idle_ticks(machine) == 0


def test_it_does_not_wait_while_the_scope_records(machine):
    machine.ask("arm_scope", axis=0, trigger=1, before=0, every=4, level=0, amplitude=0)
    assert idle_ticks(machine) == 0


def test_it_does_not_wait_at_another_baud_rate(machine):
    machine.ask("set_baud", baud=57600)
    assert idle_ticks(machine) == 0

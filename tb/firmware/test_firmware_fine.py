# SPDX-License-Identifier: Apache-2.0
"""axis.c: the motor hands over to the fine stage and takes over again, on a simulated axis."""

import pytest

from tb.firmware.test_firmware_axis import CLOSED_LOOP, ENABLE, finish, homed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, FAULT, PARAMETER, PERIOD, signed

FINE = DEFINES["AXIS_CONTROL_FINE_MASK"]
COMMAND = DEFINES["AXIS_COMMAND"]
OPEN_COMMAND = DEFINES["AXIS_OPEN_COMMAND"]
KIND = DEFINES["ACTUATOR_DRIVE"]
FINE_COMMAND = DEFINES["ACTUATOR_FINE_COMMAND"]
LIMIT = 3000
REACH = 1000
EASE = 8  # decrease of the motor command per millisecond
FINE_MS = 10


class Coarse(Axis):
    """While it is seized, the test sets its position."""

    def stand(self, error):
        self.seized = True
        self.machine = self.target - error - self.origin

    @property
    def loop(self):
        return self.control & (CLOSED_LOOP | FINE)

    @property
    def open_command(self):
        return signed(self.word[OPEN_COMMAND] & 0xFFFF, 16)


def holding(command=500, **parameters):
    machine = homed(
        Coarse(position=50 * PERIOD, low=0), fine_reach=REACH, fine_limit=LIMIT, **parameters
    )
    axis = machine.axes[0]
    axis.stand(REACH + 1)
    machine.run(3)
    axis.word[COMMAND] = command & 0xFFFF
    return machine, axis


def test_the_fine_stage_takes_over_when_the_error_was_in_reach_for_10_ms():
    machine, axis = holding()
    machine.run(50)
    assert axis.loop == CLOSED_LOOP, "out of reach"
    axis.stand(-REACH)
    machine.run(FINE_MS - 2)
    assert axis.loop == CLOSED_LOOP
    axis.stand(REACH + 1)
    machine.run(1)
    axis.stand(REACH)
    machine.run(FINE_MS - 2)
    assert axis.loop == CLOSED_LOOP, "counted from the last time out of reach"
    machine.run(4)
    assert axis.loop == FINE and axis.control & ENABLE


def test_it_does_not_take_over_while_it_returns_to_the_middle():
    machine, axis = holding()
    machine.actuators[0][FINE_COMMAND] = 0xFFFF
    axis.stand(0)
    machine.run(50)
    assert axis.loop == CLOSED_LOOP
    machine.actuators[0][FINE_COMMAND] = 0
    machine.run(FINE_MS + 2)
    assert axis.loop == FINE


@pytest.mark.parametrize("command", (500, -500))
def test_the_motor_continues_from_its_command_which_decreases_to_zero(command):
    machine, axis = holding(command)
    axis.stand(0)
    machine.run(FINE_MS + 2)
    assert (
        axis.loop == FINE
        and 0 < abs(command) - abs(axis.open_command) <= 4 * EASE
        and axis.open_command * command > 0
    )
    before = axis.open_command
    machine.run(10)
    assert abs(abs(before) - abs(axis.open_command) - 10 * EASE) <= EASE
    machine.run(70)
    assert axis.open_command == 0


def test_a_stepper_keeps_its_command():
    machine, axis = holding()
    machine.actuators[0][KIND] |= 1
    machine.ask("enable", axis=0, on=0)
    machine.set(drive=1)
    machine.ask("enable", axis=0, on=1)
    axis.word[COMMAND] = 777
    axis.stand(0)
    machine.run(100)
    assert axis.loop == FINE and axis.open_command == 777


def test_the_motor_takes_over_beyond_four_times_the_reach_or_at_the_end_of_the_range():
    for error, command in ((4 * REACH + 1, 0), (0, LIMIT), (0, -LIMIT)):
        machine, axis = holding()
        axis.stand(0)
        machine.run(FINE_MS + 2)
        axis.stand(4 * REACH)
        machine.actuators[0][FINE_COMMAND] = LIMIT - 1
        machine.run(50)
        assert axis.loop == FINE
        axis.stand(error)
        machine.actuators[0][FINE_COMMAND] = command & 0xFFFF
        machine.run(1)
        assert axis.loop == CLOSED_LOOP
        machine.actuators[0][FINE_COMMAND] = 0
        axis.stand(0)
        machine.run(FINE_MS - 2)
        assert axis.loop == CLOSED_LOOP
        machine.run(4)
        assert axis.loop == FINE


def test_the_motor_makes_the_move_and_the_fine_stage_settles_it():
    machine, axis = holding(settle_window=10)
    axis.stand(0)
    machine.run(FINE_MS + 2)
    assert axis.loop == FINE
    axis.seized = False
    machine.ask("move", axis=0, target=200 * PERIOD)
    assert axis.loop == CLOSED_LOOP
    assert machine.run(5000, until=lambda: machine.status()["state"] == "settling")
    assert axis.loop == CLOSED_LOOP, "an old time in reach does not count"
    assert finish(machine) == "ok"
    machine.run(FINE_MS + 2)
    assert axis.loop == FINE


@pytest.mark.parametrize("command", (800, -800))
def test_a_move_ends_when_the_motor_is_released(command):
    machine, axis = holding(settle_window=10, settle_time=5)
    axis.seized = False
    machine.ask("move", axis=0, target=200 * PERIOD)
    assert machine.run(5000, until=lambda: machine.status()["state"] == "settling")
    axis.stand(0)
    axis.word[COMMAND] = command & 0xFFFF  # what holds the screw wound up
    assert machine.run(5000, until=lambda: axis.loop == FINE)
    assert machine.run(5000, until=lambda: axis.open_command == 0)
    assert machine.status()["state"] == "settling"
    assert finish(machine) == "ok"


def test_a_move_whose_fine_stage_does_not_return_to_its_middle_fails():
    machine, axis = holding(settle_window=10, settle_timeout=300)
    axis.seized = False
    machine.ask("move", axis=0, target=200 * PERIOD)
    assert machine.run(5000, until=lambda: machine.status()["state"] == "settling")
    axis.stand(0)
    machine.actuators[0][FINE_COMMAND] = 1
    assert finish(machine) == "not_settled"


def test_homing_ends_within_the_reach():
    machine, axis = holding(settle_window=1)
    axis.seized = False
    machine.ask("home", axis=0)
    assert axis.loop == CLOSED_LOOP
    assert finish(machine) == "ok"


def test_off_and_fault_end_it():
    for end in (
        lambda machine, axis: machine.ask("enable", axis=0, on=0),
        lambda machine, axis: setattr(axis, "causes", FAULT["estop"]),
    ):
        machine, axis = holding()
        axis.stand(0)
        machine.run(FINE_MS + 2)
        assert axis.loop == FINE
        end(machine, axis)
        machine.run(2)
        assert axis.loop == 0 and not axis.control & ENABLE


def test_a_dac_that_drives_has_no_fine_stage():
    machine = CompiledNode(Coarse())
    for name, value, cause in (
        ("fine_reach", REACH, "ok"),
        ("drive", 2, "out_of_range"),
        ("fine_reach", 0, "ok"),
        ("drive", 2, "ok"),
        ("fine_reach", REACH, "out_of_range"),
    ):
        assert (
            machine.request("set_parameter", axis=0, parameter=PARAMETER[name]["id"], value=value)[
                0
            ]
            == cause
        ), (name, value)

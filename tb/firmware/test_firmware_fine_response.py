# SPDX-License-Identifier: Apache-2.0
"""fine_response.c: both loops open, the DAC steps, and the phases reach the host; whatever ends
this, the DAC has the values of its parameters again.
"""

import pytest

from tb.firmware.test_firmware_axis import finish, homed
from tb.firmware.test_firmware_fine import FINE_COMMAND, OPEN_COMMAND, Coarse
from twin.compiled.node import CompiledNode
from twin.compiled.tables import DEFINES, FAULT, PERIOD, TABLE

STATE = {code: name for name, (code, _) in TABLE["scope_state"].items()}
TRIM, DAC = DEFINES["ACTUATOR_DAC_TRIM"], DEFINES["ACTUATOR_DAC"]
HALF_PERIOD = DEFINES["ACTUATOR_DAC_HALF_PERIOD_MASK"]
WORDS = 1024
OWN_TRIM = -55
EASE = 8  # decrease of the motor command per millisecond


@pytest.fixture
def machine():
    made = homed(Coarse(position=50 * PERIOD, low=0), fine_limit=3000, dac_trim=OWN_TRIM)
    made.feedback_channels[0].burst = lambda phases, every: [n << 16 | every for n in range(WORDS)]
    return made


def step(machine, offset=100, every=8, axis=0):
    return machine.request("step_fine", axis=axis, offset=offset, every=every)[0]


def trim(machine):
    return machine.actuators[0][TRIM] & 0xFFFF


def refresh(machine):
    return machine.actuators[0][DAC] >> DEFINES["ACTUATOR_DAC_REFRESH_SHIFT"]


def state(machine):
    return STATE[machine.ask("read_fine", axis=0)["state"]]


def words(machine):
    out = []
    while len(out) < WORDS:
        reply = machine.ask("read_fine", axis=0)
        assert STATE[reply["state"]] == "full" and reply["first"] == len(out)
        out += [reply[f"word_{n}"] for n in range(14)]
    assert not any(out[WORDS:]), "nothing follows the last word"
    return out[:WORDS]


def test_a_step_is_the_trim_and_its_record_is_read_in_order(machine):
    assert step(machine, offset=100, every=8) == "ok"
    machine.run(3)
    assert machine.status()["state"] == "excited"
    assert trim(machine) == OWN_TRIM + 100 & 0xFFFF
    assert refresh(machine) == 0 and machine.actuators[0][DAC] & HALF_PERIOD, "words without pause"
    assert machine.feedback_channels[0].records == [(True, 8)]
    assert words(machine) == [n << 16 | 8 for n in range(WORDS)]
    assert step(machine, offset=-100, every=3) == "ok"
    machine.run(3)
    assert trim(machine) == OWN_TRIM - 100 & 0xFFFF
    assert words(machine) == [n << 16 | 3 for n in range(WORDS)], "from the first word again"


def test_it_waits_for_motor_and_fine_stage_and_for_the_end_of_the_record(machine):
    axis, channel = machine.axes[0], machine.feedback_channels[0]
    axis.word[DEFINES["AXIS_COMMAND"]] = 20 * EASE
    machine.actuators[0][FINE_COMMAND], channel.delay = 5, 4
    assert step(machine) == "ok"
    machine.run(10)
    assert state(machine) == "waiting" and not channel.records
    assert axis.word[OPEN_COMMAND] == pytest.approx(10 * EASE, abs=EASE)
    machine.run(15)
    assert axis.word[OPEN_COMMAND] == 0 and state(machine) == "waiting"
    machine.actuators[0][FINE_COMMAND] = 0
    machine.run(1)
    assert channel.records and state(machine) == "recording"
    machine.run(4)
    assert state(machine) == "full"


def test_a_disturbed_signal_is_reported(machine):
    machine.feedback_channels[0].spoiled = True
    step(machine)
    machine.run(3)
    assert machine.ask("read_fine", axis=0)["invalid"] == 1


@pytest.mark.parametrize(
    "end, after",
    [
        (lambda machine: machine.ask("stop", axis=0), "holding"),
        (lambda machine: machine.ask("enable", axis=0, on=0), "off"),
        (lambda machine: setattr(machine.axes[0], "causes", FAULT["estop"]), "faulted"),
    ],
)
def test_whatever_ends_it_the_dac_has_its_parameters_again(machine, end, after):
    before = dict(machine.actuators[0])
    step(machine)
    machine.run(3)
    assert machine.actuators[0] != before
    end(machine)
    machine.run(2)
    assert machine.status()["state"] == after and machine.actuators[0] == before
    assert machine.request("read_fine", axis=0)[0] == "not_prepared"


def test_another_open_loop_after_a_stop_is_left_alone(machine):
    step(machine)
    machine.run(3)
    machine.ask("stop", axis=0)
    machine.ask("arm_scope", axis=0, trigger=0, before=0, every=4, level=PERIOD, amplitude=500)
    machine.run(20)
    assert machine.status()["state"] == "excited"
    assert abs(machine.axes[0].word[OPEN_COMMAND]) in (500, 2**32 - 500)
    assert trim(machine) == OWN_TRIM & 0xFFFF


@pytest.mark.parametrize(
    "wrong, cause",
    [
        (dict(every=0), "out_of_range"),
        (dict(offset=-32768), "out_of_range"),  # with the trim it is no word of the DAC
    ],
)
def test_wrong_steps_are_refused_and_leave_the_axis_as_it_is(machine, wrong, cause):
    before = dict(machine.actuators[0])
    assert step(machine, **wrong) == cause
    machine.run(2)
    assert machine.status()["state"] == "holding" and machine.actuators[0] == before


def test_it_is_refused_in_a_motion_without_the_drive_and_where_the_dac_is_the_drive(machine):
    machine.ask("move", axis=0, target=60 * PERIOD)
    assert step(machine) == "busy"
    assert finish(machine) == "ok"
    machine.ask("enable", axis=0, on=0)
    assert step(machine) == "not_enabled"
    machine.set(drive=2)
    machine.ask("enable", axis=0, on=1)
    assert step(machine) == "out_of_range"


class Gliding(Coarse):
    """An axis that something else moves, fast enough for the calibration."""

    glides = False

    def tick(self):
        super().tick()
        if self.glides:
            self.machine += 1000
            self.speed = 1000


def test_a_burst_of_the_calibration_is_given_up_and_none_begins_in_open_loop():
    axis = Gliding(position=50 * PERIOD, low=0)
    machine = homed(axis, fine_limit=3000)
    channel = machine.feedback_channels[0]
    action = TABLE["calibration_action"]["calibrate"][0]
    machine.ask("calibration", axis=0, action=action)
    axis.seized = axis.glides = True
    machine.run(5)
    assert len(channel.records) == 1, "it waits for the end of its burst"
    assert step(machine, every=77) == "ok"
    machine.run(20)
    assert channel.records[1:] == [(True, 77)] and machine.status()["state"] == "excited"


def test_a_burst_that_the_calibration_reads_is_read_to_its_end_first():
    axis = Gliding(position=50 * PERIOD, low=0)
    machine = homed(axis, fine_limit=3000)
    channel = machine.feedback_channels[0]
    channel.burst = lambda phases, every: [0x1234] * WORDS
    machine.ask("calibration", axis=0, action=TABLE["calibration_action"]["calibrate"][0])
    axis.seized = axis.glides = True
    assert machine.run(50, until=lambda: channel.taken)
    axis.glides = False
    assert step(machine) == "ok"
    assert state(machine) == "waiting" and channel.taken < WORDS
    assert machine.run(50, until=lambda: len(channel.records) == 2)
    assert state(machine) in ("recording", "full")


def test_an_axis_without_fine_stage_or_recorder_has_no_such_operation():
    for feature in ("fine_stage", "recorder"):
        machine = CompiledNode(absent=(feature,))
        machine.ask("enable", axis=0, on=1)
        assert step(machine) == "not_built"

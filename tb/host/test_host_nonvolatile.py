# SPDX-License-Identifier: Apache-2.0
"""moire.client.nonvolatile and its commands, against the firmware of a station with its EEPROM."""

import json

import pytest

from moire.client.nonvolatile import SavedSettings
from moire.errors import MotionFailed, Refused
from moire.made.bus_tables import CAUSES
from tb.host.test_host_job import Workshop


@pytest.fixture
def workshop():
    made = Workshop()
    made.saved = SavedSettings(made.job.node)
    return made


def test_saved_values_survive_a_power_cut(workshop):
    workshop.station.set(kp=7)
    assert (
        (state := workshop.saved.save()).cause == "ok"
        and state.values == 2
        and state.words == "2 values are kept"
    )
    workshop.station.power_cut()
    assert workshop.saved.state() == state
    assert workshop.call("params get kp")[1].split()[1].startswith("0.0001")
    assert workshop.saved.restore_defaults().cause == "nothing_saved"
    workshop.station.power_cut()
    assert workshop.saved.state().words == "no values are kept: the defaults are in force"


def test_the_commands_save_clear_and_report(workshop):
    assert workshop.call("params save-to-node") == (0, "1 value is kept\n", "")
    code, out, _ = workshop.call("params saved-in-node --json")
    assert code == 0 and json.loads(out)["cause"] == "ok" and json.loads(out)["values"] == 1
    assert (
        workshop.call("params restore-defaults -- params saved-in-node")[1].count(
            "the defaults are in force"
        )
        == 2
    )


def test_a_damaged_copy_is_reported(workshop):
    for _ in range(2):
        workshop.saved.save()
    workshop.station.eeprom.memory[8192 + 1] ^= 1
    workshop.station.power_cut()
    assert workshop.saved.state().words == "1 value is kept; one copy of them was damaged"


def test_a_save_that_fails_is_reported_in_words(workshop):
    workshop.saved.state()
    workshop.station.eeprom.worn[8192 + 1] = 0xA5
    with pytest.raises(
        MotionFailed, match="node 2 did not save its values: the EEPROM does not keep"
    ):
        workshop.saved.save()
    workshop.station.bus.devices.pop(0x50)
    workshop.station.power_cut()
    workshop.station.run(300)
    with pytest.raises(Refused, match="the EEPROM does not answer"):
        workshop.saved.save()
    assert workshop.call("params save-to-node")[0] != 0


def test_a_fault_of_the_sub_node_is_reported_with_the_cause(workshop):
    workshop.job.load(["0deg", "10deg"])
    workshop.station.sub_node.latch("estop")
    workshop.job.start()
    state = workshop.job.wait()
    assert (
        state.table_faults == ("estop",)
        and state.cause_words == f"{dict(CAUSES.values())['faulted']} (emergency stop)"
    )
    assert "(emergency stop)" in workshop.call("job status")[1]

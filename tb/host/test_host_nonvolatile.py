# SPDX-License-Identifier: Apache-2.0
"""moire.client.nonvolatile and its commands, against the firmware of a station with its EEPROM."""

import json

import pytest

from moire.client.nonvolatile import SavedSettings
from moire.errors import MotionFailed, Refused
from moire.made.bus_tables import CAUSES, PARAMETERS
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
    assert workshop.saved.state().words == "no values are saved: the defaults are in use"


def test_the_commands_save_clear_and_report(workshop):
    assert workshop.call("params save-to-node") == (0, "1 value is kept\n", "")
    code, out, _ = workshop.call("params saved-in-node --json")
    assert code == 0 and json.loads(out)["cause"] == "ok" and json.loads(out)["values"] == 1
    assert (
        workshop.call("params restore-defaults -- params saved-in-node")[1].count(
            "the defaults are in use"
        )
        == 2
    )


def test_what_differs_from_the_saved_values_is_shown(workshop):
    def differences():
        code, out, _ = workshop.call("params diff --saved --json")
        assert code == 0
        return [tuple(one.values()) for one in json.loads(out)["differences"]]

    known = workshop.saved.parameters(0)
    assert known == {name: one.default for name, one in PARAMETERS.items()}
    workshop.station.set(kp=7, jerk=4242, travel_low=-(1 << 40))
    assert sorted(name for name, *_ in differences()) == ["jerk", "kp", "travel_low"]
    workshop.saved.save()
    assert workshop.saved.parameters(0) == {
        **known,
        **{"kp": 7, "jerk": 4242, "travel_low": -(1 << 40)},
    }
    assert workshop.call("params diff --saved")[1].endswith("all parameters agree\n")
    workshop.station.set(kp=8)
    ((name, value, saved),) = differences()
    assert name == "kp" and float(value) > float(saved) > 0
    workshop.station.power_cut()
    assert differences() == []
    workshop.saved.restore_defaults()
    assert sorted(name for name, *_ in differences()) == ["jerk", "kp", "travel_low"]
    assert workshop.call("params diff --saved stage.toml")[0] == 2


def test_saved_values_of_another_axis_and_settings_are_left_out(workshop):
    workshop.station.set(kp=7)
    workshop.station.setting(turn_frames=9)
    workshop.saved.save()
    assert workshop.saved.parameters(1) == {name: one.default for name, one in PARAMETERS.items()}


def test_values_that_cannot_be_read_are_no_defaults(workshop):
    workshop.saved.save()
    with pytest.raises(Refused, match="outside the range"):
        workshop.saved._value(1)
    eeprom = workshop.station.bus.devices.pop(0x50)
    with pytest.raises(Refused, match="the EEPROM does not answer"):
        workshop.saved.parameters(0)
    workshop.station.power_cut()
    workshop.station.run(300)
    with pytest.raises(MotionFailed, match="node 2 did not read its values: the saved values were"):
        workshop.saved.parameters(0)
    assert workshop.call("params diff --saved")[0] != 0
    workshop.station.bus.devices[0x50] = eeprom


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
        MotionFailed, match="node 2 did not save its values: the EEPROM did not store"
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

# SPDX-License-Identifier: Apache-2.0
"""nonvolatile and value_store: parameters and settings survive power cuts, and the node reports why
the defaults are in force.
"""

import random
import zlib

import pytest

from tb.bench import seed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.station import SETTING, Station
from twin.compiled.tables import PARAMETER, TABLE

COPIES = (8192, 12288)
VALUE = 16  # bytes
CHANGED = {"kp": 0, "travel_low": -5}  # parameters, in tests that save some
END = 0x101


def powered(**options):
    station = Station(**options)
    station.ready()
    return station


def restarted(station):
    station.power_cut()
    station.ready()
    return station.saved_settings()["cause"]


def parameters(station, *names):
    return {
        name: station.ask("get_parameter", axis=0, parameter=PARAMETER[name]["id"])["value"]
        for name in names or PARAMETER
    }


def settings(station, *names):
    return {
        name: station.ask("get_setting", setting=SETTING[name])["value"]
        for name in names or SETTING
    }


def default(table):
    return {name: value["default"] for name, value in table.items()}


def rewrite(station, change, copy=0):
    """Replace the values of a copy by `change(list of bytearrays)`, with a valid CRC-32."""
    at = COPIES[copy]
    memory = bytes(station.eeprom.memory)
    values = []
    while int.from_bytes((value := memory[at : at + VALUE])[8:12], "little") != END:
        values.append(bytearray(value))
        at += VALUE
    change(values)
    body = b"".join(values)
    end = zlib.crc32(body).to_bytes(8, "little") + END.to_bytes(8, "little")
    station.eeprom.memory[COPIES[copy] : COPIES[copy] + len(body) + VALUE] = body + end


def test_parameters_and_settings_are_in_force_after_a_power_cut_and_all_others_at_their_defaults():
    station = powered()
    station.set(velocity=777, kp=0, position_source=2, travel_low=-5)
    station.setting(peer_role=1, turn_frames=9)
    assert (
        station.save_settings() == "ok"
        and station.saved_settings()["values"] == 6
        and station.saved_settings()["generation"] == 1
    )
    station.set(jerk=4242)  # not saved
    assert restarted(station) == "ok"
    assert parameters(station) == {
        **default(PARAMETER),
        "velocity": 777,
        "kp": 0,
        "position_source": 2,
        "travel_low": -5,
    }
    assert settings(station) == {**default(TABLE["setting"]), "peer_role": 1, "turn_frames": 9}
    assert station.saved_settings() == {
        "writing": 0,
        "cause": "ok",
        "damaged": 0,
        "generation": 1,
        "values": 6,
    }


def saved_value(station, number):
    """One of the saved values: (owner, id, value), or the cause of a refusal."""
    while (answer := station.request("saved_value", number=number))[0] == "eeprom_busy":
        station.run(1)
    cause, reply = answer
    return tuple(reply[name] for name in ("owner", "id", "value")) if cause == "ok" else cause


def test_saved_values_are_read_back_one_by_one_and_never_older_than_the_last_save():
    station = powered()
    assert saved_value(station, 0) == "out_of_range"
    station.set(**CHANGED)
    station.setting(turn_frames=9)
    assert station.save_settings() == "ok"
    before = station.saved_settings()
    expected = sorted((0, PARAMETER[name]["id"], value) for name, value in CHANGED.items())
    expected.append((255, SETTING["turn_frames"], 9))
    assert [saved_value(station, n) for n in range(3)] == expected
    assert saved_value(station, 3) == "out_of_range"
    assert station.saved_settings() == before
    station.setting(turn_frames=8)
    assert saved_value(station, 2) == (255, SETTING["turn_frames"], 9)
    station.save_settings()
    assert saved_value(station, 2) == (255, SETTING["turn_frames"], 8)
    station.bus.devices.pop(0x50)
    assert saved_value(station, 1) == "eeprom_missing"


def test_a_sub_node_listens_to_its_main_node_only_when_its_axis_is_as_it_was():
    station, saved = (
        powered(),
        {
            name: 4242 + n
            for n, name in enumerate(
                name for name in PARAMETER if name[:8] in ("filter_1", "filter_2")
            )
        },
    )
    station.set(**saved)
    station.setting(peer_mode=2, peer_role=1)
    station.save_settings()
    station.power_cut()
    seen = []
    while not seen or station.saved_settings()["writing"]:
        station.run(0.5)
        listens, taken = (
            settings(station, "peer_mode")["peer_mode"] == 2,
            parameters(station, *saved) == saved,
        )
        assert taken or not listens
        seen.append((taken, listens))
    assert (
        seen[0] == (False, False)
        and seen[-1] == (True, True)
        and station.saved_settings()["cause"] == "ok"
    )


def test_registers_follow_the_saved_values():
    station = powered()
    station.set(kp=12345)
    station.save_settings()
    station.axes[0].word.clear()
    restarted(station)
    assert 12345 in station.axes[0].word.values()


def test_every_value_at_either_end_of_its_range_is_saved():
    station, source = powered(), random.Random(seed())
    for parameter in PARAMETER.values():
        station.request(
            "set_parameter",
            axis=0,
            parameter=parameter["id"],
            value=parameter[source.choice(("min", "max"))],
        )
    for setting in TABLE["setting"].values():
        station.ask(
            "set_setting", setting=setting["id"], value=setting[source.choice(("min", "max"))]
        )
    station.setting(peer_role=0)
    before = parameters(station), settings(station)
    assert station.save_settings() == "ok" and station.saved_settings()["values"] > 60
    assert restarted(station) == "ok" and (parameters(station), settings(station)) == before


def test_each_save_overwrites_the_older_copy():
    station = powered()
    for generation in range(1, 5):
        station.set(kp=generation)
        assert station.save_settings() == "ok"
        found = {int.from_bytes(station.eeprom.memory[at : at + 4], "little") for at in COPIES}
        assert found == {generation, generation - 1 or 0xFFFFFFFF}
        assert restarted(station) == "ok" and parameters(station, "kp") == {"kp": generation}


def test_cleared_values_are_at_their_defaults_from_the_next_power_up_on():
    station = powered()
    station.set(kp=1)
    station.save_settings()
    assert station.save_settings("clear") == "nothing_saved" and parameters(station, "kp") == {
        "kp": 1
    }
    assert restarted(station) == "nothing_saved" and parameters(station) == default(PARAMETER)
    assert station.saved_settings()["generation"] == 2 and station.saved_settings()["damaged"] == 0


def test_a_blank_eeprom_holds_nothing_and_the_panel_does_not_mention_it():
    station = powered()
    assert station.saved_settings() == {
        "writing": 0,
        "cause": "nothing_saved",
        "damaged": 0,
        "generation": 0,
        "values": 0,
    }
    station.load([1])
    assert station.job()["cause"] == "ok"


@pytest.mark.parametrize("copies", [1, 2])
def test_a_damaged_copy_is_reported_and_the_other_one_is_in_force(copies):
    station = powered()
    station.load([1])
    for kp in (1, 2):
        station.set(kp=kp)
        station.save_settings()
    for at in COPIES[::-1][:copies]:
        station.eeprom.memory[at + VALUE + 1] ^= 4
    assert (
        restarted(station) == ("ok" if copies == 1 else "saved_damaged")
        and station.saved_settings()["damaged"] == 1
    )
    assert parameters(station, "kp") == {"kp": 1 if copies == 1 else PARAMETER["kp"]["default"]}
    assert station.job()["cause"] == ("ok" if copies == 1 else "saved_damaged")
    station.set(kp=3)
    assert (
        station.save_settings() == "ok"
        and station.saved_settings()["damaged"] == 0
        and station.job()["cause"] == "ok"
    )
    assert restarted(station) == "ok" and parameters(station, "kp") == {"kp": 3}


def test_values_of_another_build_are_not_restored_and_the_panel_shows_that():
    station = powered()
    station.load([1])
    station.set(kp=1)
    station.save_settings()
    rewrite(station, lambda values: values[0].__setitem__(4, values[0][4] ^ 1))
    assert restarted(station) == "saved_other_build" and parameters(station) == default(PARAMETER)
    assert station.run(2500) is False and station.shown()[:3] == [
        "ready        001/001",
        "the saved values are",
        "from another build",
    ]


def test_values_of_a_node_with_another_count_of_axes_are_of_another_build():
    station = powered()
    station.set(kp=1)
    station.save_settings()
    station.axes.append(Axis())
    station.feedback_channels.append(type(station.feedback_channels[0])())
    station.actuators.append(dict(station.actuators[0]))
    assert restarted(station) == "saved_other_build"


def test_a_saved_value_that_is_refused_is_reported_and_the_others_are_in_force():
    station = powered()
    station.set(velocity=777, kp=5)
    station.save_settings()

    def spoil(values):
        assert values[1][12] == PARAMETER["velocity"]["id"]
        values[1][:8] = bytes(8)

    rewrite(station, spoil)
    assert restarted(station) == "saved_refused"
    assert parameters(station, "velocity", "kp") == {
        "velocity": PARAMETER["velocity"]["default"],
        "kp": 5,
    }


@pytest.mark.parametrize("last", ["list", "values"])
def test_the_settings_in_force_are_those_that_were_saved_last(last):
    station = powered()
    for what in ("values", "list") if last == "list" else ("list", "values"):
        station.setting(job_cut_limit=100 if what == last else 200)
        assert (station.load([1]) if what == "list" else station.save_settings()) == "ok"
    restarted(station)
    assert settings(station, "job_cut_limit") == {"job_cut_limit": 100}


def test_saving_leaves_station_list_and_journal_as_they_are():
    station = powered()
    station.load([1, 2, 3])
    station.firmware.journal_write(0, 6)
    station.saved()
    before = bytes(station.eeprom.memory[:8192])
    station.set(kp=1)
    station.save_settings()
    assert station.eeprom.memory[:8192] == before and station.station_list() == [1, 2, 3]
    assert (
        station.save_settings("clear") == "nothing_saved"
        and station.ask("job_stations")["ended"] == 0
    )


def test_saving_does_not_make_a_station_list():
    station = powered()
    station.set(kp=1)
    assert (
        station.save_settings() == "ok"
        and station.do("start") == "no_job"
        and station.job()["cause"] == "no_job"
    )


def test_a_missing_eeprom_is_reported_and_its_values_are_restored_at_power_up_only():
    station = powered()
    station.set(kp=1)
    station.save_settings()
    station.bus.devices.pop(0x50)
    station.power_cut()
    station.run(500)
    assert (
        station.saved_settings()["cause"] == "saved_not_read"
        and station.request("save_settings", action=0)[0] == "eeprom_missing"
    )
    station.bus.devices[0x50] = station.eeprom
    station.ready()
    assert (
        parameters(station, "kp") == {"kp": PARAMETER["kp"]["default"]}
        and station.saved_settings()["cause"] == "saved_not_read"
    )
    assert restarted(station) == "ok" and parameters(station, "kp") == {"kp": 1}


def test_a_worn_page_is_reported_and_the_old_values_stay():
    station = powered()
    station.set(kp=1)
    station.save_settings()
    station.eeprom.worn[COPIES[1] + VALUE + 1] = 0xA5
    station.set(kp=2)
    assert station.save_settings() == "eeprom_failed"
    assert restarted(station) == "ok" and parameters(station, "kp") == {"kp": 1}


def test_saving_is_refused_while_the_eeprom_is_written_and_so_is_an_unknown_action():
    station = powered()
    assert station.request("save_settings", action=2)[0] == "out_of_range"
    station.ask("save_settings", action=0)
    assert (
        station.request("save_settings", action=0)[0] == "eeprom_busy"
        and station.saved_settings()["writing"] == 1
    )


def test_values_that_change_while_they_are_written_leave_a_whole_copy():
    station, source = powered(), random.Random(seed())
    names = [name for name in PARAMETER if name.startswith(("filter_1", "filter_2", "signal_"))]
    station.ask("save_settings", action=0)
    while station.saved_settings()["writing"]:
        station.set(**{source.choice(names): source.randrange(100)})
        station.run(1)
    assert restarted(station) == "ok" and station.saved_settings()["damaged"] == 0


def test_a_power_cut_at_any_moment_of_a_save_leaves_the_old_values_or_the_new_ones():
    source, station = random.Random(seed()), powered()
    names = [name for name in PARAMETER if name.startswith(("filter_1", "filter_2"))]
    station.save_settings()
    old, seen = parameters(station), set()
    for _ in range(40):
        station.set(
            **{
                name: source.randrange(1000)
                for name in source.sample(names, source.randrange(1, len(names)))
            }
        )
        new = parameters(station)
        station.ask("save_settings", action=0)
        station.run(source.uniform(0, 180))
        restarted(station)
        found = parameters(station)
        assert found in (old, new)
        seen.add(found == new)
        old = found
    assert seen == {True, False}


def test_the_axis_image_saves_nothing():
    machine = CompiledNode()
    assert (
        machine.request("save_settings", action=0)[0]
        == machine.request("saved_settings")[0]
        == "not_built"
    )


def test_a_blank_eeprom_that_comes_late_holds_nothing():
    station = Station(absent=["eeprom"])
    station.run(500)
    assert station.saved_settings()["cause"] == "saved_not_read"
    station.bus.devices[0x50] = station.eeprom
    station.ready()
    assert (
        station.saved_settings()["cause"] == "nothing_saved"
        and station.load([1]) == "ok"
        and station.job()["cause"] == "ok"
    )

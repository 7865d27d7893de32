# SPDX-License-Identifier: Apache-2.0
"""The panel: station lists are entered by key, causes are shown in words, and devices may be absent
or come late.
"""

import pytest

from twin.compiled.station import SETTING, TURN, Station
from twin.compiled.station_devices import KEYS
from twin.compiled.tables import TABLE


@pytest.fixture
def station():
    made = Station()
    made.ready()
    made.run(2500)  # the panel is found
    return made


def test_the_panel_shows_that_there_is_no_station_list(station):
    assert station.shown() == ["ready", "no station list is", "stored", ""]
    assert {"keypad", "display", "eeprom"} <= station.job()["flags"]


def test_the_display_gets_nothing_too_soon_and_rs_is_set_before_e(station):
    station.press("DIVIDE", "6", "ENTER")
    station.run(3000)
    assert (
        station.display.too_soon == 0 and station.display.rs_moved == 0 and station.display.port & 8
    )


def test_a_turn_is_divided_by_its_count(station):
    station.press("DIVIDE", "7")
    assert station.shown()[:2] == ["stations in a turn", "7_"]
    station.press("ENTER")
    assert station.saved() == "ok"
    assert station.station_list() == [(n * TURN + 3) // 7 for n in range(7)]
    assert station.shown() == ["ready        001/007", "             0.00000", "", "START"]


def test_a_list_is_entered_angle_by_angle(station):
    station.press("LIST", *"12.5", "ENTER")
    assert station.shown()[0] == "angle, degrees   002"
    station.press(*"359.99999", "ENTER", "ENTER")
    assert station.saved() == "ok" and station.station_list() == [4_500_000, 129_599_996]


def test_up_and_down_browse_through_the_stations(station):
    station.load([0, 360_000, 45 * 360_000 + 180_000])
    station.press("UP", "UP", "UP")
    assert station.shown()[:2] == ["station      003/003", "            45.50000"]
    station.press("UP", "DOWN", "DOWN")
    assert station.shown()[:2] == ["station      002/003", "             1.00000"]
    station.press("CLEAR")
    assert station.shown()[0] == "ready        001/003"


def test_longest_cut_and_speed_are_settings(station):
    station.press("LIMIT", *"900", "ENTER", "SPEED", *"40", "ENTER")
    assert [
        station.ask("get_setting", setting=SETTING[name])["value"]
        for name in ("job_cut_limit", "job_speed")
    ] == [900, 40]


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (["DIVIDE", "0", "ENTER"], ["a station list needs", "at least one station"]),
        (["DIVIDE", *"361", "ENTER"], ["the EEPROM is full:", "it holds 360"][:1]),
        (["DIVIDE", *"3.5", "ENTER"], ["the value is outside"]),
        (["DIVIDE", "ENTER"], ["the value is outside"]),
        (["LIST", *"360", "ENTER"], ["angles must be below", "360 degrees"]),
        (["LIST", *"10", "ENTER", *"10", "ENTER"], ["each angle must be", "larger than the last"]),
        (["LIST", ".", "ENTER"], ["the value is outside"]),
        (["LIST", *"1.2.3", "ENTER"], ["the value is outside"]),
        (["LIST", "ENTER"], ["a station list needs", "at least one station"]),
        (["LIST", *"99999999999", "9"], ["the value is outside"]),
        (["LIMIT", "0", "ENTER"], ["the value is outside"]),
        (["SPEED", *"101", "ENTER"], ["the value is outside"]),
    ],
)
def test_an_entry_out_of_range_is_refused_in_words(station, keys, words):
    station.press(*keys)
    shown = station.shown()
    at = next(
        (
            n
            for n, line in enumerate(shown)
            if line == words[0] or words[0].startswith(line) and len(line) > 15
        ),
        None,
    )
    assert at is not None and shown[at + 1 : at + len(words)] == words[1:], shown
    assert station.station_list() == []


@pytest.mark.parametrize("key", [*range(25, 34), "5", ".", "ENTER"])
def test_a_key_without_a_function_is_refused_in_words(station, key):
    station.press(key)
    shown = station.shown()
    assert shown[1:3] == ["this key has no", "function"], shown
    station.run(3500)
    assert station.shown()[1:3] == ["no station list is", "stored"]


def test_clear_clears_the_entry_and_then_leaves_the_mode(station):
    station.press("LIST", *"12")
    station.press("CLEAR")
    assert station.shown()[1] == "_"
    station.press("CLEAR")
    assert station.shown()[0] == "ready"


def test_every_cause_of_a_station_fits_the_panel():
    for code, words in TABLE["cause"].values():
        if code < 30:
            continue
        rows, said = [""], words.split(":")[0].split()
        for word in said:
            if rows[-1] and len(rows[-1]) + 1 + len(word) > 20:
                rows.append("")
            rows[-1] += " " * bool(rows[-1]) + word
        assert len(rows) <= (3 if code < 40 else 2) and max(map(len, rows)) <= 20, words
    assert all(len(words) <= 12 for _, words in TABLE["job_state"].values())


@pytest.mark.parametrize("absent", [["keypad"], ["display"], ["keypad", "display"]])
def test_a_node_without_its_panel_works_and_reports_what_is_missing(absent):
    station = Station(absent=absent)
    station.ready()
    station.run(2500)
    assert station.load([1, 2]) == "ok"
    assert not set(absent) & station.job()["flags"] and len(
        {"keypad", "display"} & station.job()["flags"]
    ) == 2 - len(absent)


def test_a_panel_that_comes_later_is_found_and_earlier_keys_do_not_count():
    station = Station(absent=["keypad", "display"])
    station.ready()
    station.keypad.registers[0x1D:0x1F] = b"\x1f\x7f"  # set up by the node before a reset
    station.keypad.press("DIVIDE")
    station.bus.devices[0x34], station.bus.devices[0x27] = station.keypad, station.display
    station.run(2500)
    assert station.shown()[0] == "ready"
    station.press("DIVIDE")
    assert station.shown()[0] == "stations in a turn"


def test_a_display_that_lost_its_power_is_set_up_again_when_it_is_back(station):
    device = station.bus.devices.pop(0x27)
    station.run(1500)
    assert "display" not in station.job()["flags"]
    device.power_cut(station.clk)
    station.bus.devices[0x27] = device
    station.run(2500)
    assert (
        station.shown()[0] == "ready" and device.too_soon <= 1
    )  # only the first byte, which is sent once more than needed


def test_every_key_of_the_layout_reaches_its_function():
    assert len(KEYS) == 25 and [KEYS[n] for n in (0, 3, 21, 24)] == ["7", "START", "0", "CLEAR"]

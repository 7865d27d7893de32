# SPDX-License-Identifier: Apache-2.0
"""store, station_list and journal: they survive power cuts, and every failure is reported."""

import random

import pytest

from tb.bench import seed
from twin.compiled.station import SETTING, TURN, Station
from twin.compiled.station_devices import Eeprom, ms

EVENLY = [n * TURN // 36 for n in range(36)]


def powered(**options):
    station = Station(**options)
    station.ready()
    return station


def test_a_station_list_reads_back_as_written_also_after_a_power_cut():
    station = powered()
    assert station.load(EVENLY) == "ok" and station.station_list() == EVENLY
    station.power_cut()
    station.ready()
    assert station.station_list() == EVENLY and station.ask("job_stations")["generation"] == 1


def test_each_new_station_list_overwrites_the_older_copy():
    station = powered()
    for generation in range(1, 5):
        angles = [generation, 2 * generation + 5]
        assert station.load(angles) == "ok"
        copies = {int.from_bytes(station.eeprom.memory[at : at + 4], "little") for at in (0, 2048)}
        assert copies == {generation, generation - 1 or 0xFFFFFFFF}
        assert station.station_list() == angles


def test_as_many_stations_as_fit_are_saved_and_one_more_is_refused():
    station = powered()
    angles = [n * TURN // 360 for n in range(360)]
    station.ask("job_begin")
    for n, angle in enumerate(angles):
        station.ask("job_add", station=n, angle=angle)
    assert station.request("job_add", station=360, angle=TURN - 1)[0] == "too_many_stations"
    station.ask("job_save")
    assert station.saved() == "ok" and station.station_list() == angles
    station.power_cut()
    station.ready()
    assert station.station_list() == angles


@pytest.mark.parametrize(
    ("angles", "cause"),
    [
        ([TURN], "angle_out_of_turn"),
        ([0xFFFFFFFF], "angle_out_of_turn"),
        ([5, 5], "angles_not_ascending"),
        ([5, 4], "angles_not_ascending"),
    ],
)
def test_an_invalid_angle_is_refused_with_its_cause(angles, cause):
    station = powered()
    station.ask("job_begin")
    for n, angle in enumerate(angles[:-1]):
        station.ask("job_add", station=n, angle=angle)
    assert station.request("job_add", station=len(angles) - 1, angle=angles[-1])[0] == cause
    station.ask("job_add", station=len(angles) - 1, angle=TURN - 1)  # the others are still there
    station.ask("job_save")
    assert station.saved() == "ok" and station.station_list() == [*angles[:-1], TURN - 1]


def test_an_incomplete_station_list_is_refused():
    station = powered()
    assert station.request("job_save")[0] == "no_stations"
    assert station.request("job_add", station=0, angle=0)[0] == "job_incomplete"
    station.ask("job_begin")
    assert station.request("job_save")[0] == "no_stations"
    assert station.request("job_add", station=1, angle=0)[0] == "job_incomplete"
    assert station.ask("job_stations")["stations"] == 0
    assert station.request("job_angle", station=0)[0] == "out_of_range"


def test_settings_are_saved_with_the_station_list():
    station = powered()
    station.setting(job_cut_limit=77, peer_mode=2)
    assert station.load(EVENLY) == "ok"
    station.power_cut()
    station.ready()
    assert [
        station.ask("get_setting", setting=SETTING[name])["value"]
        for name in ("job_cut_limit", "peer_mode")
    ] == [77, 2]


def test_a_blank_eeprom_has_no_job():
    station = powered()
    assert station.ask("job_stations") == {
        "writing": 0,
        "ended": 43,
        "generation": 0,
        "stations": 0,
        "journal": 0,
    }
    assert station.do("start") == "no_job"


@pytest.mark.parametrize("copies", [1, 2])
def test_a_damaged_copy_is_reported_and_the_other_one_is_in_force(copies):
    station = powered()
    station.load([1, 2, 3])
    station.load([4, 5, 6])  # over copy 0
    for at in (90, 2048 + 90)[:copies]:
        station.eeprom.memory[at] ^= 4
    station.power_cut()
    job = station.ready()
    assert "copy_damaged" in job["flags"]
    if copies == 1:
        assert station.station_list() == [1, 2, 3]
        assert station.load([7]) == "ok" and "copy_damaged" not in station.job()["flags"]
    else:
        assert station.station_list() == [] and station.do("start") == "job_damaged"


def test_a_missing_eeprom_is_reported_and_found_when_it_comes():
    station = Station(absent=["eeprom"])
    station.run(2000)
    job = station.job()
    assert (job["state"], job["cause"]) == ("loading", "eeprom_missing") and "store" not in job[
        "flags"
    ]
    assert (
        station.do("start") == "eeprom_missing"
        and station.request("job_begin")[0] == "eeprom_missing"
    )
    station.bus.devices[0x50] = station.eeprom
    station.ready()
    assert station.load(EVENLY) == "ok"


def test_an_eeprom_in_exchange_for_another_one_begins_with_generation_1():
    station = powered()
    assert [station.load(EVENLY) for _ in range(3)] == ["ok"] * 3
    station.power_cut()
    station.eeprom.memory[:] = b"\xff" * len(station.eeprom.memory)
    station.ready()
    assert station.load(EVENLY) == "ok" and station.ask("job_stations")["generation"] == 1


def test_a_node_says_that_it_writes_until_all_is_saved():
    station = powered()
    assert station.ask("job_stations")["writing"] == 0
    station.ask("job_begin")
    station.ask("job_add", station=0, angle=5)
    station.ask("job_save")
    assert station.ask("job_stations")["writing"] == 1
    assert station.saved() == "ok" and station.ask("job_stations")["writing"] == 0
    absent = Station(absent=["eeprom"])
    absent.run(2000)
    assert absent.ask("job_stations")["writing"] == 0


def test_an_eeprom_that_fails_for_a_moment_leaves_the_settings_as_they_are():
    station = powered()
    limit = SETTING["job_cut_limit"]
    station.setting(job_cut_limit=77)
    assert station.load(EVENLY) == "ok"
    station.setting(job_cut_limit=88)
    eeprom = station.bus.devices.pop(0x50)
    assert station.load([1]) == "eeprom_missing"
    station.bus.devices[0x50] = eeprom
    assert station.run(4000, until=lambda: station.request("job_begin")[0] == "ok")
    assert station.station_list() == EVENLY
    assert station.ask("get_setting", setting=limit)["value"] == 88
    station.power_cut()
    station.ready()
    assert station.ask("get_setting", setting=limit)["value"] == 77


def test_a_stuck_bus_is_reported_until_it_is_free():
    station = Station()
    station.bus.stuck = True
    station.run(2000)
    assert station.job()["cause"] == "eeprom_missing"
    station.bus.stuck = False
    station.ready()


def test_a_node_without_i2c_reports_a_missing_eeprom():
    station = Station(peripherals_built=0)
    station.run(500)
    assert station.job()["cause"] == "eeprom_missing"


def test_a_worn_page_of_the_station_list_is_reported_and_the_old_list_stays():
    station = powered()
    station.load([1, 2, 3])
    station.eeprom.worn[2048 + 90] = 0xA5
    station.eeprom.worn[90] = 0xA5
    assert station.load(EVENLY) == "eeprom_failed" and station.station_list() == [1, 2, 3]


def test_a_write_that_the_device_never_ends_is_reported():
    station = powered()
    station.eeprom.WRITE = ms(10_000)
    assert station.load(EVENLY) == "eeprom_missing"


def test_a_power_cut_at_any_moment_leaves_the_old_station_list_or_the_new_one():
    source, station = random.Random(seed()), powered()
    old, seen = [], set()
    for _ in range(40):
        new = sorted(source.sample(range(TURN), source.randrange(1, 40)))
        station.ask("job_begin")
        for n, angle in enumerate(new):
            station.ask("job_add", station=n, angle=angle)
        station.ask("job_save")
        station.run(source.uniform(0, 260))
        station.power_cut()
        station.ready()
        found = station.station_list()
        assert found in (old, new)
        seen.add(found == new)
        old = found
    assert seen == {True, False}


def test_writes_are_spread_over_the_pages_of_the_journal():
    station, pages = powered(), []
    stopped = Eeprom.stopped

    def noticed(eeprom, now):
        if len(eeprom.came) > 2:
            pages.append(eeprom.pointer // 64)
        stopped(eeprom, now)

    station.load([1])
    station.eeprom.stopped = lambda now: noticed(station.eeprom, now)
    for _ in range(130):
        assert station.firmware.journal_write(0, 1) == 0
        station.saved()
    assert (
        len(pages) == 130
        and set(pages) == set(range(64, 128))
        and max(map(pages.count, pages)) == 3
    )
    station.power_cut()
    station.ready()
    assert station.ask("job_stations")["journal"] == 130


def test_a_worn_page_of_the_journal_is_passed_over():
    station = powered()
    station.load([1])
    station.eeprom.worn[4096 + 64 * 1 + 3] = 0x5A  # where the first record goes
    assert station.firmware.journal_write(0, 1) == 0 and station.saved() == "ok"
    assert station.ask("job_stations")["journal"] == 2


def test_records_behind_worn_pages_that_stay_blank_are_found():
    station = powered()
    station.load([1])
    for page in (1, 2):  # as many as a record passes over
        station.eeprom.worn.update({4096 + 64 * page + n: 0xFF for n in range(64)})
    for sequence in (3, 4):
        assert station.firmware.journal_write(0, 1) == 0 and station.saved() == "ok"
        station.power_cut()
        station.ready()
        assert station.ask("job_stations")["journal"] == sequence


def test_a_journal_with_few_records_is_not_read_to_its_end():
    station = powered()
    for records in (1, 20):  # 6: the job was stopped
        station.load([1])
        for _ in range(records):
            assert station.firmware.journal_write(0, 6) == 0 and station.saved() == "ok"
        station.power_cut()
        begun = station.clk
        station.ready()
        assert station.clk - begun < ms(60 + 7 * records)

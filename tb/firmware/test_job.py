# SPDX-License-Identifier: Apache-2.0
"""Jobs: all stations are cut, every failure is provoked, and no station is ever cut twice."""

import random

import pytest

from tb.bench import seed
from twin.compiled.station import TURN, Station
from twin.compiled.station_devices import MOST_TYPED, ms
from twin.compiled.sub_node import SubNode

STATIONS = 4
ANGLES = [n * TURN // STATIONS for n in range(STATIONS)]
FRAMES, PRINTED = 2, 1


def node(frames=True, angles=ANGLES, panel=False, **options):
    """A main node with a sub-node and a station list."""
    station = Station(absent=() if panel else ("keypad", "display"), **options)
    station.sub_node = SubNode(frames=frames)
    station.setting(
        peer_mode=FRAMES if frames else PRINTED,
        job_start_limit=2,
        job_cut_limit=5,
        peer_timeout=3000,
    )
    station.ready()
    assert station.load(angles) == "ok"
    station.run(2500 if panel else 0)  # it is found
    return station


def start(station, *states):
    assert station.do("start") == "ok"
    return station.until(*states or ["finished"])


def cuts(station):
    return len(station.edm.cuts)


@pytest.mark.parametrize("frames", [True, False])
def test_a_job_cuts_every_station_once_and_in_order(frames):
    station = node(frames)
    job = start(station, "finished", "paused", "unsure")
    assert job["state"] == "finished" and job["cause"] == "ok" and cuts(station) == STATIONS
    assert station.sub_node.angles == (ANGLES if frames else [None] * STATIONS)
    assert station.edm.received == station.edm.START * STATIONS
    assert station.do("start") == "ok"  # and again, from the first station on
    station.until("finished")
    assert cuts(station) == 2 * STATIONS


def test_the_sub_node_receives_the_speed_before_each_station():
    station = node()
    station.setting(job_speed=50)
    start(station)
    assert station.sub_node.speeds == [32768] * STATIONS


def test_the_table_turns_only_while_the_machine_is_at_rest():
    station = node()
    assert station.do("start") == "ok"
    while station.job()["state"] != "finished":
        station.run(5)
        assert not (station.edm.inputs & 1 and station.sub_node.there_at is not None)


def test_every_cut_is_in_the_journal_before_the_keys_are_sent():
    station = node()
    start(station, "turning")
    for n in range(STATIONS):
        station.until("cutting")
        record = station.eeprom.memory[4096 : 4096 + 64 * 64]
        newest = max(
            (
                record[at : at + 12]
                for at in range(0, len(record), 64)
                if record[at : at + 4] != b"\xff" * 4
            ),
            key=lambda record: int.from_bytes(record[:4], "little"),
        )
        assert (newest[8], newest[10]) == (n, 3)  # station, cut begun
        station.until("ended", "leaving", "turning", "finishing")


# a person


def test_pause_stops_before_the_next_cut_and_resume_continues():
    station = node()
    start(station, "cutting")
    assert station.do("pause") == "ok" and "pausing" in station.job()["flags"]
    job = station.until("paused")
    assert (
        job["cause"] == "paused_by_operator"
        and job["station"] == 1
        and cuts(station) == 1
        and job["answers"] == {"resume", "stop"}
    )
    station.run(3000)
    assert cuts(station) == 1
    assert station.do("resume") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_pause_while_the_table_turns_stops_before_the_cut():
    station = node()
    start(station, "turning")
    station.do("pause")
    assert station.until("paused")["station"] == 0 and cuts(station) == 0
    station.do("resume")
    station.until("finished")
    assert cuts(station) == STATIONS


@pytest.mark.parametrize("at", ["turning", "cutting", "paused"])
def test_stop_ends_the_job_wherever_it_is(at):
    station = node()
    start(station, "turning")
    if at == "paused":
        station.do("pause")
    station.until(at)
    assert station.do("stop") == "ok"
    station.until("idle")
    begun = cuts(station)
    station.run(3000)
    assert cuts(station) == begun and station.sub_node.there_at is None
    station.power_cut()
    assert station.ready()["state"] == "idle"  # nothing remains of the job


@pytest.mark.parametrize(
    ("action", "cause"),
    [
        ("resume", "not_now"),
        ("again", "not_now"),
        ("next", "not_now"),
        ("stop", "not_now"),
        ("pause", "not_now"),
    ],
)
def test_actions_that_do_not_apply_are_refused(action, cause):
    station = node()
    assert station.do(action) == cause and station.job()["answers"] == {"start"}
    assert station.request("job_do", action=6)[0] == "out_of_range"


def test_the_station_list_cannot_change_while_a_job_is_under_way():
    station = node()
    start(station, "cutting")
    for operation, fields in (("job_begin", {}), ("job_save", {})):
        assert station.request(operation, **fields)[0] == "job_active"
    assert station.do("start") == "job_active"
    station.until("finished")
    assert station.load([5]) == "ok"


TYPED = [0, MOST_TYPED]  # bytes of a person so far; their counter saturates


@pytest.mark.parametrize("typed", TYPED)
def test_the_keys_wait_while_a_person_types(typed):
    station = node()
    station.edm.typed = typed
    station.edm.types_until = station.clk + ms(25_000)
    start(station, "cutting")
    station.run(15_000)
    assert (
        cuts(station) == 0
        and "keys_pending" in station.job()["flags"]
        and station.edm.received == b""
    )
    station.until("finished")
    assert cuts(station) == STATIONS and station.edm.received == station.edm.START * STATIONS


@pytest.mark.parametrize("typed", TYPED)
def test_the_keys_that_were_sent_wait_while_a_person_types(typed):
    station = node()
    start(station, "cutting")
    assert station.run(5000, until=lambda: station.edm.queue)
    station.edm.typed = typed
    station.edm.types_until = station.clk + ms(25_000)
    station.run(15_000)
    assert station.job()["state"] == "cutting" and cuts(station) == 0
    station.until("finished")
    assert cuts(station) == STATIONS and station.edm.received == station.edm.START * STATIONS


# the machine


def test_a_machine_that_begins_to_cut_by_itself_gets_no_keys():
    station = node()
    start(station, "cutting")
    station.edm.set(1)
    job = station.until("unsure")
    assert job["cause"] == "edm_busy" and station.edm.received == b""
    station.edm.set(0)
    assert station.do("again") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_a_cut_that_is_interrupted_for_a_moment_is_one_cut():
    station = node()
    start(station, "cutting")
    assert station.run(2000, until=lambda: station.edm.inputs & 1)
    for level in (0, 1):
        station.edm.set(level)
        station.run(100)
        assert station.job()["state"] == "cutting" and station.sub_node.requests == 1
    station.until("finished")
    assert cuts(station) == STATIONS and station.edm.received == station.edm.START * STATIONS


def test_after_a_cut_that_does_not_start_a_person_is_asked_and_no_key_is_sent_again():
    station = node()
    station.edm.deaf = True
    job = start(station, "unsure")
    assert job["cause"] == "cut_not_started" and job["answers"] == {"again", "next", "stop"}
    station.run(10_000)
    assert station.edm.received == station.edm.START
    station.edm.deaf = False
    assert station.do("again") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_next_counts_the_station_as_cut():
    station = node()
    station.edm.deaf = True
    start(station, "unsure")
    station.edm.deaf = False
    station.do("next")
    station.until("finished")
    assert cuts(station) == STATIONS - 1 and station.sub_node.angles == ANGLES


def test_after_a_cut_that_does_not_end_a_person_is_asked_and_may_follow_it():
    station = node()
    station.edm.endless = True
    job = start(station, "unsure")
    assert job["cause"] == "cut_not_ended" and job["answers"] == {"resume", "next", "stop"}
    assert station.do("again") == "edm_busy"  # else it would cut twice
    assert station.do("resume") == "ok"
    station.until("following")
    station.edm.endless = False
    station.until("finished")
    assert cuts(station) == STATIONS


def test_next_waits_until_the_machine_is_at_rest():
    station = node()
    station.edm.endless = True
    start(station, "unsure")
    station.do("next")
    station.run(3000)
    assert station.job()["state"] == "leaving" and station.sub_node.requests == 1
    station.edm.endless = False
    station.until("finished")
    assert cuts(station) == STATIONS


def test_after_an_alarm_in_the_cut_a_person_is_asked_and_the_panel_shows_why():
    station = node(panel=True)
    start(station, "cutting")
    assert station.run(2000, until=lambda: station.edm.inputs & 1)
    station.edm.alarm()
    job = station.until("unsure")
    assert (
        job["cause"] == "edm_alarm"
        and {"alarm"} <= job["flags"]
        and job["answers"] == {"next", "stop"}
    )
    assert station.shown()[1:3] == ["the EDM reports an", "alarm"]
    assert station.do("again") == "edm_alarm"
    station.edm.alarm(False)
    assert station.do("again") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS + 1  # the person said so


def test_an_alarm_shortly_after_the_end_of_the_cut_counts():
    station = node()
    start(station, "cutting")
    assert station.run(2000, until=lambda: station.edm.inputs & 1)
    assert station.run(2000, until=lambda: not station.edm.inputs & 1)
    station.run(100)
    station.edm.alarm()
    assert station.until("unsure")["cause"] == "edm_alarm"


def test_an_alarm_before_the_cut_pauses():
    station = node()
    start(station, "turning")
    station.edm.alarm()
    job = station.until("paused")
    assert (
        job["cause"] == "edm_alarm"
        and station.do("resume") == "edm_alarm"
        and station.edm.received == b""
    )
    station.edm.alarm(False)
    station.do("resume")
    station.until("finished")
    assert cuts(station) == STATIONS


def test_a_cut_of_a_few_milliseconds_is_noticed():
    station = node()
    station.edm.cut_ms = 0.1
    start(station)
    assert cuts(station) == STATIONS


def test_keys_that_the_machine_does_not_take_are_dropped_and_never_come_late():
    station = node()
    station.edm.takes_nothing = True
    job = start(station, "unsure")
    assert (
        job["cause"] == "keys_not_taken"
        and "keys_pending" not in job["flags"]
        and job["answers"] == {"again", "next", "stop"}
    )
    station.edm.takes_nothing = False
    station.run(5000)
    assert cuts(station) == 0 and station.edm.received == b""
    station.do("again")
    station.until("finished")
    assert cuts(station) == STATIONS and station.edm.received == station.edm.START * STATIONS


def test_a_machine_that_takes_half_the_keys_is_reported_and_gets_the_others_once():
    station = node()
    start(station, "cutting")
    assert station.run(5000, until=lambda: station.edm.injecting)
    station.edm.next_key = station.clk + ms(30_000)
    job = station.until("unsure")
    assert (
        job["cause"] == "keys_not_taken"
        and station.do("again") == "edm_busy"
        and "keys_pending" in job["flags"]
    )
    assert station.run(30_000, until=lambda: station.edm.inputs & 1)
    assert station.do("resume") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS and station.edm.received == station.edm.START * STATIONS


def test_stop_drops_the_keys_that_wait():
    station = node()
    station.edm.takes_nothing = True
    start(station, "cutting")
    assert station.run(5000, until=lambda: station.edm.queue)
    station.do("stop")
    station.until("idle")
    station.edm.takes_nothing = False
    station.run(5000)
    assert cuts(station) == 0 and station.edm.received == b"" and station.do("start") == "ok"


def test_a_machine_that_cuts_or_alarms_is_not_started():
    station = node()
    station.edm.set(1)
    assert station.do("start") == "edm_busy"
    station.edm.set(2)
    assert station.do("start") == "edm_alarm"


@pytest.mark.parametrize("missing", [2, 32])
def test_a_node_without_keyboard_or_status_inputs_does_no_job(missing):
    assert node(peripherals_built=63 & ~missing).do("start") == "not_built"


# the sub-node


@pytest.mark.parametrize(
    "cause", ["sensor_timed_out", "not_converged", "sensor_disagrees", "stiction"]
)
def test_the_cause_of_the_sub_node_is_reported_and_resume_tries_again(cause):
    station = node()
    station.sub_node.fault = cause
    job = start(station, "paused")
    assert job["cause"] == cause and cuts(station) == 0
    station.sub_node.fault = None
    station.do("resume")
    station.until("finished")
    assert cuts(station) == STATIONS


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("estop", ["emergency stop", ""]),
        ("following_error", ["following error too", "large"]),
        ("step_overrun", ["too many steps are", "pending"]),
    ],
)
def test_a_fault_of_the_sub_node_is_shown_and_reset_by_resume_when_its_cause_is_gone(fault, words):
    station = node(panel=True)
    start(station, "turning")
    station.run(50)
    station.sub_node.latch(fault, "cpu")
    station.sub_node.cause_persists = True
    job = station.until("paused")
    assert (
        job["cause"] == "ended_by_fault"
        and job["table_faults"] == {fault}
        and job["answers"] == {"resume", "stop"}
    )
    seen = [station.shown()[1:3] for _ in range(12)]
    assert words in seen and ["a fault ended the", "motion"] in seen
    station.run(5000)
    assert station.sub_node.resets == 0  # never by itself
    station.press("RESUME")
    job = station.until("paused")
    assert (
        job["cause"] == "fault_persists"
        and job["table_faults"] == {fault}
        and station.sub_node.resets == 1
    )
    station.sub_node.cause_persists = False
    station.press("RESUME")
    station.until("finished")
    assert (
        cuts(station) == STATIONS
        and station.sub_node.resets == 2
        and station.job()["table_faults"] == set()
    )


def test_a_fault_of_the_sub_node_is_reset_by_resume_only():
    station = node()
    start(station, "cutting")
    station.sub_node.latch("drive")
    job = station.until("paused")
    assert (job["cause"], job["table_faults"], job["station"]) == ("faulted", {"drive"}, 1)
    station.do("stop")
    station.until("idle")
    assert (
        station.do("start") == "ok"
        and station.until("paused")["cause"] == "faulted"
        and station.sub_node.resets == 0
    )
    station.do("resume")
    station.until("finished")
    assert station.sub_node.resets == 1 and cuts(station) == 1 + STATIONS


def test_a_fault_that_comes_between_two_tries_is_reported_before_it_is_reset():
    station = node()
    station.sub_node.fault = "stiction"
    start(station, "paused")
    station.sub_node.latch("drive")
    station.do("resume")
    station.until("turning")
    assert station.until("paused")["cause"] == "faulted" and station.sub_node.resets == 0


def test_a_silent_sub_node_pauses_the_job_with_that_cause():
    station = node()
    station.sub_node.dead = True
    assert start(station, "paused")["cause"] == "peer_silent"
    station.sub_node.dead = False
    station.do("resume")
    station.until("finished")
    assert cuts(station) == STATIONS


def test_a_sub_node_starts_no_job():
    station = node()
    station.setting(peer_role=1)
    assert station.do("start") == "peer_off" and station.ask("job_stations")["journal"] == 0


def test_a_peer_port_that_is_not_in_use_pauses_the_job_with_that_cause():
    station = node()
    station.setting(peer_mode=0)
    assert start(station, "paused")["cause"] == "peer_off"


def test_a_sub_node_that_counts_is_never_sent_on_while_its_position_is_unknown():
    station = node(frames=False)
    station.sub_node.fault = "no_motion_yet"
    assert start(station, "paused")["cause"] == "check_sub_node"
    assert (
        station.job()["answers"] == {"stop"}
        and station.do("resume") == "table_position_unknown"
        and station.sub_node.requests == 1
    )
    station.do("stop")
    station.until("idle")


def test_a_sub_node_that_counts_is_not_sent_to_the_same_station_twice():
    station = node(frames=False)
    station.edm.deaf = True
    start(station, "unsure")
    station.power_cut()
    assert station.ready()["state"] == "unsure"
    station.edm.deaf = False
    station.do("again")
    station.until("finished")
    assert station.sub_node.requests == STATIONS and cuts(station) == STATIONS


# power


def test_after_a_power_cut_in_the_cut_a_person_is_asked():
    station = node()
    station.edm.cut_ms = 4000
    start(station, "cutting")
    assert station.run(2000, until=lambda: station.edm.inputs & 1)
    station.power_cut()
    job = station.ready()
    assert (job["state"], job["cause"], job["station"]) == (
        "unsure",
        "power_lost",
        0,
    ) and "again" not in job["answers"]
    assert station.do("resume") == "ok"  # it still cuts: follow it
    station.until("finished")
    assert cuts(station) == STATIONS


@pytest.mark.parametrize("answer", ["again", "next"])
def test_a_cut_that_ended_without_power_is_cut_again_only_if_a_person_says_so(answer):
    station = node(panel=True)
    start(station, "cutting")
    assert station.run(2000, until=lambda: station.edm.inputs & 1)
    station.power_cut()
    station.run(5000)
    job = station.job()
    assert (
        job["state"] == "unsure"
        and job["answers"] == {"again", "next", "stop"}
        and cuts(station) == 1
    )
    station.run(2500)
    assert station.shown() == [
        "is it cut?   001/004",
        "the power was lost",
        "during the job",
        "STOP AGAIN NEXT",
    ]
    station.press(answer.upper())
    station.until("finished")
    assert cuts(station) == STATIONS + (answer == "again")


def test_a_job_whose_power_failed_between_cuts_waits_for_resume_and_misses_none():
    station = node()
    start(station, "cutting")
    station.until("turning")
    station.power_cut()
    job = station.ready()
    assert (job["state"], job["cause"], job["station"]) == ("paused", "power_lost", 1) and job[
        "answers"
    ] == {"resume", "stop"}
    station.run(3000)
    assert cuts(station) == 1
    station.do("resume")
    station.until("finished")
    assert cuts(station) == STATIONS


def test_power_cuts_at_any_moment_leave_no_station_uncut_and_cut_none_twice():
    """A person inspects the workpiece and answers: the cut that had begun was made, or was not."""
    source = random.Random(seed())
    station = node()
    for _ in range(6):
        station.edm.cuts.clear()
        station.sub_node.angles.clear()
        station.do("start")
        cut_at = []
        for _ in range(source.randrange(1, 4)):
            station.run(source.uniform(0, 4000))
            station.power_cut()
            station.run(1200)
            station.ready()
            station.run(1500)  # a cut that was under way has ended
            job = station.job()
            if job["state"] == "unsure":
                begun = (
                    bool(station.edm.cuts)
                    and station.sub_node.angles[-1] == ANGLES[job["station"]]
                    and len(station.edm.cuts) == job["station"] + 1
                )
                assert station.do("next" if begun else "again") == "ok"
            elif job["state"] == "paused":
                assert station.do("resume") == "ok"
            cut_at.append(job["state"])
        if station.job()["state"] != "idle":
            station.until("finished")
            assert len(station.edm.cuts) == STATIONS, cut_at


def test_a_job_of_another_station_list_is_not_resumed():
    station = node(angles=[1, 2])
    assert station.load(ANGLES) == "ok"  # over the older copy, the first
    start(station, "cutting")
    station.eeprom.memory[90] ^= 1
    station.power_cut()
    job = station.ready()
    assert (
        job["state"] == "idle"
        and station.station_list() == [1, 2]
        and "copy_damaged" in job["flags"]
    )


# the EEPROM in the job


def test_no_cut_begins_that_is_not_in_the_journal():
    station = node()
    start(station, "turning")
    station.bus.devices.pop(0x50)
    job = station.until("paused")
    assert (
        job["cause"] == "eeprom_missing"
        and station.edm.received == b""
        and station.do("resume") == "eeprom_missing"
    )
    station.bus.devices[0x50] = station.eeprom
    station.run(4000)
    assert station.do("resume") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_another_eeprom_in_the_middle_of_a_job_is_refused():
    other = node(angles=[1, 2]).eeprom
    station = node()
    start(station, "turning")
    mine = station.bus.devices.pop(0x50)
    station.until("paused")
    station.bus.devices[0x50] = other
    station.run(4000)
    assert (
        station.do("resume") == "job_changed"
        and station.job()["answers"] == {"stop"}
        and cuts(station) == 0
    )
    station.bus.devices.pop(0x50)
    station.power_cut()
    station.bus.devices[0x50] = mine
    assert station.ready()["state"] == "paused" and station.do("resume") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_after_a_cut_whose_end_cannot_be_recorded_a_person_is_asked():
    station = node()
    start(station, "cutting")
    station.bus.devices.pop(0x50)
    job = station.until("unsure")
    assert job["cause"] == "eeprom_missing"
    station.bus.devices[0x50] = station.eeprom
    station.run(4000)
    assert station.do("next") == "ok"
    station.until("finished")
    assert cuts(station) == STATIONS


def test_a_job_is_run_by_the_keys_of_the_panel():
    station = node(panel=True)
    station.press("START")
    station.until("cutting")
    station.press("PAUSE")
    station.until("paused")
    assert station.shown() == ["paused       002/004", "paused by the", "operator", "RESUME STOP"]
    station.press("NEXT")
    assert station.shown()[1:3] == ["the job does not", "expect this now"]
    station.press("RESUME")
    station.until("finished")
    assert cuts(station) == STATIONS and station.shown()[0] == "all cut      004/004"

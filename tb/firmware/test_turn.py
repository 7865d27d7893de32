# SPDX-License-Identifier: Apache-2.0
"""Turning a table with worm errors, backlash and stiction to angles of its sensor; every cause is
provoked.
"""

import random

import pytest

from tb.bench import seed
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.peripherals import TURN_ARCSEC, PeripheralParts, Sensor, Table
from twin.compiled.tables import CAUSE, DEFINES, FAULT, TABLE

PHASE = {code: name for name, (code, _) in TABLE["turn_phase"].items()}
SETTING = TABLE["setting"]
PER_ARCSEC = 100
DEGREE = 3600
AXIS = {
    "position_source": 2,
    "velocity": 30000,
    "acceleration": 500000,
    "jerk": 50000000,
    "homing_latch_speed": 300,
    "following_limit": 2**31 - 1,
}


class Station(CompiledNode):
    def __init__(self, angle=0.0, sensor=None, parameters=None, **table):
        self.random = random.Random(seed())
        self.table = Table(self.random, angle=angle, **table)
        self.sensor = Sensor(self.random, self.table, **(sensor or {}))
        super().__init__(Axis(), image="station", peripherals=PeripheralParts(self.sensor))
        self.set(**{**AXIS, **(parameters or {})})
        self.run(50)

    def configure(self, **settings):
        for name, value in settings.items():
            self.ask("set_setting", setting=SETTING[name]["id"], value=value)

    def state(self):
        state = self.ask("turn_state")
        return {**state, "phase": PHASE[state["phase"]], "ended": CAUSE[state["ended"]]}

    def begin(self, arcsec):
        return self.request("turn_to", angle=round(arcsec * PER_ARCSEC))[0]

    def until(self, phase, ms=60_000):
        assert self.run(ms, until=lambda: self.state()["phase"] == phase), self.state()

    def turn(self, arcsec):
        """Turn to an angle, arcsec; returns the cause with which that ended."""
        assert self.begin(arcsec) == "ok"
        self.until("idle", 120_000)
        return self.state()["ended"]

    def error(self, arcsec):
        """Of the true angle, arcsec, in the shorter direction."""
        return (self.table.angle - arcsec + TURN_ARCSEC / 2) % TURN_ARCSEC - TURN_ARCSEC / 2


def test_every_target_is_reached_within_two_arcsec_of_the_truth_from_either_side():
    station, source = Station(), random.Random(seed())
    for arcsec in [
        10 * DEGREE,
        5 * DEGREE,
        5 * DEGREE + 30,
        *(source.uniform(0, TURN_ARCSEC / 36) for _ in range(4)),
    ]:
        assert station.turn(arcsec) == "ok"
        assert abs(station.state()["left"]) <= 50 and abs(station.error(arcsec)) <= 2


def test_the_worm_always_pushes_up_at_the_end_so_backlash_is_taken_up():
    station = Station(backlash=50)
    for arcsec in (2 * DEGREE, DEGREE, DEGREE + 20, DEGREE - 20):
        assert station.turn(arcsec) == "ok"
        worm = station.axes[0].machine / 65536 * 4 * 0.18
        assert station.table.nut == worm


def test_the_long_distance_ends_below_the_target_and_each_try_halves_the_remainder():
    station = Station(worm_error=0, wheel_error=0, stick=0, sensor={"noise": 0, "wave": 0})
    station.begin(DEGREE)
    station.until("closing_in")
    assert station.state()["left"] == pytest.approx(60 * PER_ARCSEC, abs=40)
    left = []
    while station.state()["phase"] != "idle":
        station.until("reading")
        station.run(500, until=lambda: station.state()["phase"] != "reading")
        left.append(station.state()["left"])
    assert len(left) == station.state()["tries"] == 7
    assert all(
        now == pytest.approx(before / 2, abs=20)
        for before, now in zip([6000, *left], left, strict=False)
    )


def test_the_share_of_a_try_is_a_setting():
    tries = []
    for share in (30, 50, 80):
        station = Station(stick=0, sensor={"noise": 0, "wave": 0})
        station.configure(turn_share=share)
        assert station.turn(DEGREE) == "ok"
        tries.append(station.state()["tries"])
    assert tries[0] > tries[1] > tries[2] > 1


def test_a_table_at_the_target_does_not_move():
    station = Station(angle=DEGREE + 0.1, sensor={"noise": 0, "wave": 0})
    assert station.turn(DEGREE) == "ok"
    assert (
        station.axes[0].pushed == [] and station.state()["tries"] == 0 and station.axes[0].enabled
    )


@pytest.mark.parametrize(
    ("direction", "begin", "target", "turned"),
    [
        (0, 1 * DEGREE, 359 * DEGREE, 358),
        (1, 1 * DEGREE, 359 * DEGREE, -2),
        (2, 1 * DEGREE, 359 * DEGREE, 358),
        (0, 359 * DEGREE, 1 * DEGREE, -358),
        (1, 359 * DEGREE, 1 * DEGREE, 2),
        (2, 359 * DEGREE, 1 * DEGREE, 2),
        (0, TURN_ARCSEC - 1, 1 * DEGREE, 1),
    ],
)
def test_the_direction_is_a_setting_and_a_little_below_zero_counts_as_zero(
    direction, begin, target, turned
):
    station = Station(
        angle=begin,
        parameters={"velocity": 900_000, "acceleration": 90_000_000, "jerk": 2_000_000_000},
    )
    station.configure(turn_direction=direction)
    assert station.turn(target) == "ok"
    assert (
        station.table.angle - begin == pytest.approx(turned * DEGREE, abs=5)
        and abs(station.error(target)) <= 2
    )


def test_after_an_overshoot_the_table_goes_below_the_target_and_comes_up_again():
    station = Station(worm_error=30)
    station.configure(turn_allowance=0, turn_overshoots=10)
    assert all(
        station.turn(arcsec) == "ok" for arcsec in (DEGREE, 2 * DEGREE, 3 * DEGREE, 4 * DEGREE)
    )
    met = []
    for arcsec in range(5, 10):
        assert station.turn(arcsec * DEGREE) == "ok" and abs(station.error(arcsec * DEGREE)) <= 2
        met.append(station.state()["overshoots"])
    assert any(met)


def test_overshoots_are_limited():
    station = Station(worm_error=0, wheel_error=0)
    station.configure(turn_allowance=0, turn_overshoots=0, turn_tolerance=1)
    station.table.angle += 25  # an error of the worm that was not there before
    station.table.offset += 25
    assert "not_converged" in {station.turn(arcsec * DEGREE) for arcsec in range(1, 9)}


def test_the_zero_of_the_sensor_is_a_setting():
    station = Station(angle=1000)
    station.configure(sensor_zero=900 * PER_ARCSEC)
    assert station.ask("sensor")["angle"] == pytest.approx(100 * PER_ARCSEC, abs=110)
    assert station.turn(500) == "ok" and abs(station.error(1400)) <= 2
    station.configure(sensor_zero=1500 * PER_ARCSEC)
    assert station.ask("sensor")["angle"] == pytest.approx(
        (TURN_ARCSEC - 100) * PER_ARCSEC, abs=210
    )


# frames that are lost or damaged


def test_lost_and_damaged_frames_are_counted_and_change_nothing_else():
    station = Station(sensor={"lost": 0.1, "damaged": 0.2})
    assert station.turn(3 * DEGREE) == "ok" and abs(station.error(3 * DEGREE)) <= 2
    reported = station.ask("sensor")
    assert reported["frames"] == station.sensor.frames and reported["timed_out"] == 0
    assert reported["missed"] > reported["wrong_crc"] > 0.1 * reported["frames"]


def test_a_reading_takes_only_frames_sent_after_the_table_had_settled():
    station = Station(stick=0, sensor={"noise": 0, "wave": 0})
    station.configure(turn_settle=0, turn_frames=1)
    station.begin(DEGREE)
    station.until("closing_in")
    assert station.state()["reading"] / PER_ARCSEC == pytest.approx(station.table.angle, abs=0.7)


def test_the_sensor_is_read_for_ever_though_the_counter_of_its_frames_saturates():
    station = Station()
    station.sensor.counted = DEFINES["PERIPHERALS_SENSOR_FRAMES_MASK"]
    station.run(1000)
    assert station.ask("sensor")["timed_out"] == 0 and station.sensor.counted <= 1
    assert station.turn(DEGREE) == "ok"


def test_frames_that_came_before_the_start_of_the_firmware_do_not_count():
    station = Station()
    station.sensor.counted = 500
    station.firmware.firmware_start()
    assert station.ask("sensor")["frames"] == 0


# every cause


def test_a_sensor_that_never_sent_a_frame_has_timed_out():
    station = Station()
    station.sensor.dead = True
    station.run(300)
    assert station.ask("sensor")["timed_out"] == 1
    assert station.begin(DEGREE) == "sensor_timed_out" and station.axes[0].pushed == []
    assert station.status()["state"] == "off" and not station.axes[0].enabled


def test_a_sensor_that_fails_during_a_move_stops_the_table_under_control():
    station = Station(parameters={"velocity": 2000})
    station.begin(90 * DEGREE)
    station.until("coming_up")
    station.run(200)
    station.sensor.dead = True
    station.until("idle", 400)
    assert station.state()["ended"] == "sensor_timed_out"
    assert (
        station.run(1000, until=lambda: station.status()["state"] == "holding")
        and station.axes[0].faults == 0
    )
    assert station.table.angle < 2 * DEGREE


def test_a_sensor_that_fails_while_it_is_read_is_reported():
    station = Station()
    station.begin(DEGREE)
    station.until("closing_in")
    station.until("reading")
    station.sensor.dead = True
    station.until("idle", 400)
    assert station.state()["ended"] == "sensor_timed_out"


def test_a_sensor_that_sends_one_angle_for_ever_is_stuck():
    station = Station()
    station.sensor.stuck = True
    station.run(50)
    assert station.turn(DEGREE) == "sensor_stuck"


def test_a_sensor_that_sticks_while_closing_in_is_reported():
    station = Station()
    station.begin(DEGREE)
    station.until("closing_in")
    station.sensor.stuck = True
    station.until("idle")
    assert station.state()["ended"] == "sensor_stuck"


def test_a_table_that_does_not_turn_is_distinguished_from_a_stuck_sensor():
    station = Station()
    station.table.blocked = True
    assert station.turn(DEGREE) == "stiction"


def test_a_table_that_sticks_at_the_end_is_reported():
    station = Station()
    station.begin(DEGREE)
    station.until("closing_in")
    station.table.blocked = True
    station.until("idle")
    assert station.state()["ended"] == "stiction"


@pytest.mark.parametrize("arcsec", [DEGREE, -DEGREE, 20])
def test_a_motor_that_turns_in_the_wrong_direction_is_reported(arcsec):
    station = Station(angle=10 * DEGREE, sign=-1)
    assert station.turn(10 * DEGREE + arcsec) == "wrong_sign"


def test_a_wrong_number_of_steps_a_turn_shows_as_disagreement():
    station = Station()
    station.configure(periods_per_turn=2_000_000)
    assert station.turn(2 * DEGREE) == "sensor_disagrees"


def test_a_tolerance_that_cannot_be_met_ends_with_not_converged():
    station = Station(sensor={"noise": 3})
    station.configure(turn_tolerance=1, turn_frames=1, turn_tries=10, turn_overshoots=1)
    assert "not_converged" in {station.turn(arcsec * DEGREE) for arcsec in (1, 2)}


@pytest.mark.parametrize("hundredths", [129_600_000, 2**32 - 1])
def test_an_angle_beyond_a_turn_is_refused(hundredths):
    station = Station()
    assert station.request("turn_to", angle=hundredths)[0] == "out_of_range"


def test_a_node_without_a_sensor_reports_that():
    machine = CompiledNode(image="station")
    assert (
        machine.request("turn_to", angle=0)[0] == "not_built"
        and machine.request("sensor")[0] == "not_built"
    )


# other commands to the axis


def test_a_second_turn_is_refused_until_the_first_has_ended():
    station = Station()
    station.begin(DEGREE)
    assert station.begin(2 * DEGREE) == "busy"
    station.until("idle")
    assert station.state()["ended"] == "ok" and abs(station.error(DEGREE)) <= 2


@pytest.mark.parametrize("phase", ["reading", "going_below", "coming_up", "closing_in"])
def test_the_host_can_stop_a_turn_at_any_time(phase):
    station = Station(angle=10 * DEGREE)
    station.begin(5 * DEGREE)
    station.until(phase)
    station.ask("stop", axis=0)
    station.run(20)
    assert station.state()["phase"] == "idle" and station.state()["ended"] == "stopped"
    assert station.run(2000, until=lambda: station.status()["state"] == "holding")
    assert station.begin(9 * DEGREE) == "ok"


def test_a_drive_that_is_switched_off_ends_the_turn():
    station = Station()
    station.begin(DEGREE)
    station.until("coming_up")
    station.ask("enable", axis=0, on=0)
    station.run(2)
    assert station.state()["ended"] == "stopped" and not station.axes[0].enabled


@pytest.mark.parametrize("phase", ["reading", "coming_up"])
def test_a_fault_ends_the_turn_and_prevents_the_next_one(phase):
    station = Station()
    station.begin(DEGREE)
    station.until(phase)
    station.axes[0].causes = FAULT["estop"]
    station.run(5)
    assert station.state()["ended"] == "ended_by_fault"
    assert station.begin(DEGREE) == "faulted"
    station.axes[0].causes = 0
    station.ask("reset_faults", axis=0)
    assert station.turn(DEGREE) == "ok"


def test_a_turn_is_refused_while_the_host_moves_the_axis():
    station = Station()
    station.set(home_method=35, travel_high=10**9)
    station.ask("enable", axis=0, on=1)
    station.ask("home", axis=0)
    assert station.run(3000, until=lambda: station.status()["ended"] == "ok")
    station.ask("move", axis=0, target=10**8)
    assert station.begin(DEGREE) == "busy"


def test_closing_in_uses_the_homing_latch_speed():
    station = Station(parameters={"homing_latch_speed": 40})
    station.begin(DEGREE)
    station.until("closing_in")
    speeds = []
    while station.state()["phase"] == "closing_in":
        station.run(1)
        speeds.append(station.axes[0].player.velocity)
    assert max(speeds) * 4000 / 2**40 == pytest.approx(40, rel=0.05)

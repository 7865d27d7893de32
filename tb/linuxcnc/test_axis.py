# SPDX-License-Identifier: Apache-2.0
"""An axis of the driver with an ideal axis of a node, period by period; LinuxCNC is its pins."""

import ctypes

import pytest

from linuxcnc_config.set_up import set_up
from tb.linuxcnc.compiled import AXIS_PINS, CAUSES, Axis, driver
from tb.linuxcnc.ideal_node import (
    CLK_HZ,
    ENDED,
    OFF,
    PERIOD_CYCLES,
    PREPARED,
    STATE,
    STILL,
    STREAMING,
    TICK,
    IdealNode,
    address,
    placed,
)

PERIOD_S, TICK_S = PERIOD_CYCLES / CLK_HZ, TICK / CLK_HZ
DELAY = 20  # ticks until a set-point, the usual ones
PERIODS_PER_MM, MM_S = 250.0, 50.0
LSB_MM = 1 / 65536 / PERIODS_PER_MM
HOMED = 2000  # periods by which a homing has ended
WORD = 1 << 32


class Driven:
    """The axis, homed if it is to be, and its pins as attributes."""

    def __init__(self, homed=True, delay=DELAY):
        self.node, self.delay, self.cause = IdealNode(1), delay, 0
        set_up(self.node, 1, 5, watchdog_s=0)
        self.axis, self.values = Axis(), {name: kind() for name, kind in AXIS_PINS.items()}
        for name, value in self.values.items():
            setattr(self.axis.pins, name, ctypes.pointer(value))
        self.set(scale=PERIODS_PER_MM, enable=True, index_enable=homed)
        if homed:
            self.until(lambda: not self.pin("index_enable"))
            self.run(2)

    @property
    def ideal(self):
        return self.node.axes[0]

    def pin(self, name):
        return self.values[name].value

    def set(self, **pins):
        for name, value in pins.items():
            self.values[name].value = value

    def period(self, sends=True, replies=True):
        """A servo period, in which a packet each way may be lost. Before it is homed, LinuxCNC
        commands what it sees, as after it has switched an axis on.
        """
        if replies:
            words = (ctypes.c_uint32 * self.node.reads)(*self.node._read_list())
            tick_s = ctypes.c_double(TICK_S)
            driver().axis_take(ctypes.byref(self.axis), words, 1, 0, tick_s)
        period_s = ctypes.c_double(PERIOD_S)
        driver().axis_decide(ctypes.byref(self.axis), self.cause, period_s)
        asks = driver().axis_give(
            ctypes.byref(self.axis), period_s, ctypes.c_double(TICK_S), ctypes.c_double(0)
        )
        if sends:
            self.send(asks)
        self.asks = asks
        self.node.advance(PERIOD_CYCLES)

    def send(self, asks):
        """What a request writes."""
        low = address("axis", "set_point_position")
        self.node.write(low, asks.position % WORD)
        self.node.write(low + 4, asks.position >> 32 & WORD - 1)
        self.node.write(address("axis", "set_point_velocity"), asks.velocity % WORD)
        requests = dict(enable=asks.enable, home=asks.home, stream=asks.stream)
        requests = placed("node", "axis_requests", **requests, reset_faults=asks.reset)
        self.node.write(address("node", "axis_requests"), requests)
        self.node.write(address("node", "set_point_tick"), self.node.tick + self.delay)
        self.node.write(address("node", "set_point_commit"), int(asks.commit))

    def run(self, periods, **packets):
        for _ in range(periods):
            self.period(**packets)

    def until(self, condition, most=HOMED, **packets):
        for _ in range(most):
            if condition():
                return
            self.period(**packets)
        raise AssertionError("it did not come")

    def move(self, periods, **packets):
        """Along at constant velocity; LinuxCNC switches the axis off as soon as it has a fault."""
        for _ in range(periods):
            fault = self.pin("fault")
            moved = 0 if fault else MM_S * PERIOD_S
            command = self.pin("position_cmd") + moved
            self.set(position_cmd=command, enable=not fault)
            self.period(**packets)

    def cut(self):
        """The velocity at which the drive went off, in periods per tick."""
        (found,) = self.ideal.cuts
        return found


def test_an_axis_is_homed_and_follows():
    driven = Driven()
    driven.move(500)
    assert driven.ideal.mode == STREAMING and not driven.pin("fault")
    behind = (DELAY * TICK_S + 2 * PERIOD_S) * MM_S
    assert driven.pin("position") == pytest.approx(500 * PERIOD_S * MM_S - behind, abs=0.1)


def test_an_axis_whose_set_points_came_too_late_stops_under_control_before_its_drive_goes_off():
    driven = Driven()
    driven.move(500)
    driven.move(14, sends=False)
    assert driven.ideal.mode == ENDED and driven.ideal.velocity > 100 * STILL
    driven.move(2)
    assert driven.pin("fault") and driven.pin("fault_cause") == CAUSES["set_point_late"]
    driven.move(200)
    assert abs(driven.cut()) < STILL and driven.pin("fault_cause") == 0 and not driven.pin("fault")
    driven.set(enable=True, position_cmd=driven.pin("position"))
    driven.until(lambda: driven.ideal.mode == STREAMING)
    assert not driven.pin("fault")


def test_an_axis_stops_under_control_where_too_many_packets_were_lost_but_not_for_ever():
    driven = Driven()
    driven.move(500)
    driven.cause = CAUSES["link_lost"]
    driven.move(1)
    assert driven.pin("fault") and driven.pin("fault_cause") == CAUSES["link_lost"]
    driven.move(200)
    assert abs(driven.cut()) < STILL
    driven = Driven()
    driven.move(500)
    driven.cause = CAUSES["link_lost"]
    driven.move(900, replies=False)
    assert driven.ideal.enabled and driven.ideal.state == STATE["holding"]
    driven.move(200, replies=False)
    assert not driven.ideal.enabled


def test_a_drive_that_may_not_be_on_goes_off_at_once():
    driven = Driven()
    driven.move(500)
    driven.cause = CAUSES["link_lost"]
    driven.move(10)
    driven.cause = CAUSES["not_allowed"]
    driven.move(10)
    assert driven.cut() > STILL
    driven = Driven()
    driven.move(500)
    driven.set(enable=False)
    driven.run(10)
    assert driven.cut() > STILL


def test_a_drive_that_the_node_switches_off_ends_the_stop():
    driven = Driven()
    driven.move(500)
    driven.cause = CAUSES["link_lost"]
    driven.run(5)
    driven.node.press_estop()
    driven.run(2)
    assert driven.pin("fault") and not driven.asks.enable
    driven.set(enable=False)
    driven.run(2)
    assert not driven.pin("fault")


def test_a_homing_that_linuxcnc_aborts_ends_in_the_node_without_a_jump_of_the_position():
    driven = Driven(homed=False)
    driven.until(lambda: driven.pin("enabled"))
    driven.run(5)
    driven.set(position_cmd=driven.pin("position_fb"), index_enable=True)
    driven.until(lambda: driven.ideal.state == STATE["homing"])
    driven.ideal.home_ticks *= 100
    driven.run(4000)
    at = driven.pin("position_cmd")
    driven.set(index_enable=False)
    for _ in range(HOMED):
        driven.period()
        assert abs(driven.pin("position_fb") - at) < LSB_MM
    assert driven.ideal.state == STATE["holding"] and not driven.ideal.homed
    assert abs(driven.ideal.position) > 100 and not driven.pin("fault"), "it has not gone on"
    driven.set(index_enable=True)
    driven.until(lambda: driven.ideal.homed)
    driven.until(lambda: driven.ideal.mode == STREAMING)
    assert not driven.pin("index_enable")


@pytest.mark.parametrize("phase", ["releasing", "preparing"])
def test_an_axis_that_is_homed_does_not_move_where_linuxcnc_aborts_the_homing(phase):
    driven = Driven()
    driven.move(100)
    driven.run(100)
    driven.set(index_enable=True)
    driven.run(1)
    if phase == "preparing":
        driven.until(lambda: driven.ideal.state == STATE["homing"])
        driven.until(lambda: driven.ideal.homed)
        driven.run(1)
    driven.set(index_enable=False)
    at = driven.ideal.position
    for _ in range(HOMED):
        driven.period()
        assert not driven.asks.home
    assert driven.ideal.enabled and driven.ideal.state == STATE["holding"]
    assert driven.ideal.mode == OFF and driven.ideal.position == pytest.approx(at, abs=20)


def test_a_delay_beyond_what_the_node_queues_is_a_fault_and_no_silence():
    driven = Driven(delay=60)
    driven.move(100)
    assert driven.ideal.mode == STREAMING and not driven.pin("fault")
    driven = Driven(delay=300)
    driven.run(100)
    assert driven.ideal.mode in (OFF, PREPARED) and driven.pin("fault")
    assert driven.pin("fault_cause") == CAUSES["not_prepared"]

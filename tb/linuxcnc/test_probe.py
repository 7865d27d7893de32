# SPDX-License-Identifier: Apache-2.0
"""The touch probe in the driver: positions latched by the node, read by spare accesses, one in each
packet, some of which are lost.
"""

import ctypes
import random

import pytest

from tb.bench import seed
from tb.linuxcnc.compiled import Access, Latch, Probe, driver
from tb.linuxcnc.ideal_node import CLEARS, FALLING, INDEX, RISING, address, placed

OFF, SOURCES, CLEAR, ARMED, READ, DONE = range(6)
SETTLING, ARMING, PROBE_ARMED, TAKING = range(4)
AXES, WRITE = 3, 1 << 31
FAR = 1 << 46  # the longest travel
STEADY, PATIENCE = 10, 20  # replies, as in probe.c


class Captures:
    """The captures of an axis of a node."""

    def __init__(self):
        self.sources, self.queue, self.position = 0, [], 0

    def access(self, axis, access):
        """Serves a spare access; the value that is read."""
        at = {
            address("feedback", "capture_sources", axis): "sources",
            address("feedback", "strobes", axis): "strobes",
            address("feedback", "captured_position", axis): "position",
        }[access.spare % WRITE]
        assert (access.spare >= WRITE) == (at != "position")
        if at == "sources":
            self.sources = access.value
        elif at == "strobes":
            assert access.value == CLEARS
            self.queue = []
        else:
            return self.queue[0] % (1 << 32)
        return 0

    def event(self, source):
        if self.sources & source:
            self.queue.append(self.position)


class Machine:
    """Axes with a probe, and the driver."""

    def __init__(self, lost=0.0, seed=0):
        self.dice, self.lost = random.Random(seed), lost
        self.axes = [Captures() for _ in range(AXES)]
        self.latches, self.probe = (Latch * AXES)(), Probe()
        self.pin = False

    def edge(self, near=False):
        """The axes move, and the probe touches, or leaves; their positions then."""
        self.pin = not self.pin
        for axis in self.axes:
            moved = self.dice.randrange(100)
            axis.position = axis.position + moved if near else self.dice.randrange(-FAR, FAR)
            axis.event(RISING if self.pin else FALLING)
        return [axis.position for axis in self.axes]

    def exchange(self, ready=True):
        """A packet each way; whether positions of an edge are there. None if one is lost."""
        access, asked = Access(), None
        for n in range(AXES):
            place = ctypes.byref(self.latches, n * ctypes.sizeof(Latch))
            if driver().latch_asks(place, n, ctypes.byref(access)):
                asked = n, place
                break
        lost = self.dice.random() < self.lost
        if lost and self.dice.random() < 0.5:
            return None  # the request
        states = [placed("feedback", "capture_state", present=bool(a.queue)) for a in self.axes]
        value = self.axes[asked[0]].access(asked[0], access) if asked else 0
        if lost:
            return None  # the reply
        for n, state in enumerate(states):
            driver().latch_look(ctypes.byref(self.latches, n * ctypes.sizeof(Latch)), state)
        if asked:
            moved = self.axes[asked[0]].position + self.dice.randrange(-(1 << 30), 1 << 30)
            driver().latch_answer(asked[1], value, ctypes.c_int64(moved))
        return driver().probe_take(ctypes.byref(self.probe), self.latches, AXES, self.pin, ready)

    def until(self, condition, most=2000):
        for _ in range(most):
            edge = self.exchange()
            if condition(edge):
                return
        raise AssertionError("it did not come")

    def armed(self):
        self.until(lambda edge: self.probe.phase == PROBE_ARMED)


@pytest.mark.parametrize("lost", [0, 0.01, 0.3])
def test_each_edge_has_the_positions_that_the_node_latched_even_if_packets_are_lost(lost):
    machine = Machine(lost, seed())
    for _ in range(50):
        machine.armed()
        level = machine.probe.level
        positions = machine.edge()
        machine.until(bool)
        assert machine.probe.level != level and machine.probe.level == machine.pin
        assert [latch.position for latch in machine.latches] == positions


def test_an_edge_is_shown_as_many_packets_later_as_there_are_axes_and_one():
    machine = Machine()
    machine.armed()
    machine.edge()
    assert [machine.exchange() for _ in range(AXES + 1)] == [False] * AXES + [True]


def test_a_contact_that_bounces_is_one_edge_at_its_first_touch():
    machine = Machine()
    machine.armed()
    positions = machine.edge()
    shown = 0
    for _ in range(7):
        machine.edge(near=True)
    for _ in range(4 * STEADY):
        if machine.exchange():
            shown += 1
            assert [latch.position for latch in machine.latches] == positions
    assert shown == 1 and machine.probe.level is False, "it touches no longer"
    machine.armed()


def test_a_probe_that_touches_at_the_start_is_shown_without_an_edge():
    machine = Machine()
    machine.edge()
    assert not any(machine.exchange(ready=False) for _ in range(STEADY + 1))
    assert machine.probe.level is True
    assert all(latch.phase == OFF for latch in machine.latches), "homing has the captures"
    machine.armed()
    assert {axis.sources for axis in machine.axes} == {FALLING}


def test_a_level_whose_edge_was_not_latched_is_shown_after_the_patience():
    machine = Machine()
    machine.armed()
    machine.pin = True  # no axis has captured it
    assert not any(machine.exchange() for _ in range(PATIENCE + STEADY + 4))
    assert machine.probe.level is True


def test_an_edge_while_the_latches_are_armed_is_shown_when_it_is_steady():
    machine = Machine()
    machine.until(lambda edge: machine.probe.phase == ARMING)
    machine.pin = True
    assert not any(machine.exchange() for _ in range(STEADY + 2))
    assert machine.probe.level is True and machine.probe.phase == ARMING


def test_the_captures_are_left_alone_as_soon_as_an_axis_does_not_follow():
    machine = Machine()
    machine.armed()
    machine.exchange(ready=False)
    assert machine.probe.phase == SETTLING
    assert all(latch.phase == OFF for latch in machine.latches)
    assert INDEX not in {axis.sources for axis in machine.axes}

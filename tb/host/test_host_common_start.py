# SPDX-License-Identifier: Apache-2.0
"""moire.client: several axes and nodes that start together."""

import pytest

from moire.client.bus import Bus
from moire.description import Description
from moire.errors import BusError, NoAnswer, OutOfRange, Refused
from moire.machine import Machine
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.stage import two_nodes

PATIENT = "10s"  # for a watchdog, longer than a host waits for a node that does not answer


def two_axes():
    """A node with both axes homed."""
    wire = Rs485Bus(BusNode(axes=2))
    node = Bus(wire).node(1)
    for number in (0, 1):
        node.axis(number).enable()
        node.axis(number).home()
    return wire, node


def test_prepared_axes_begin_together_and_end_one_after_the_other():
    wire, node = two_axes()
    # acceleration and deceleration take 48 ms and two times 10 ms for their jerk
    assert node.axis(0).prepare("2mm") == pytest.approx(2500 / 6000 + 0.058, abs=1e-3)
    node.axis(1).prepare(mm=1)
    assert node.axis(0).status().state == "prepared" and node.axis(0).status().position_nm == 0
    seen = []
    ended = node.start(
        0, 1, progress=lambda status: seen.append([wire.nodes[0].state(n) for n in (0, 1)])
    )
    assert [round(status.position_nm) for status in ended] == [2_000_000, 1_000_000]
    assert seen[0] == ["moving", "moving"] and all(status.ended == "ok" for status in ended)


def test_axes_of_two_nodes_begin_at_one_sync():
    wire, bus = two_nodes()
    chosen = [bus.axis(1), bus.axis(2, 1)]
    for axis in chosen:
        axis.prepare(mm=1)
    seen = []
    ended = bus.start(
        *chosen,
        progress=lambda status: seen.append(
            [node.state(n) for node in wire.nodes for n in range(len(node.axes))]
        ),
    )
    assert (
        seen[0][0] == seen[0][2] == "moving" != seen[0][1]
        and [round(status.position_nm) for status in ended] == [1_000_000] * 2
    )
    assert [node.counters["syncs"] for node in wire.nodes] == [1, 1]


def test_while_one_axis_moves_the_drives_of_other_nodes_stay_on():
    wire, bus = two_nodes()
    first, second, third = bus.axis(1), bus.axis(2), bus.axis(2, 1)
    began = wire.now()
    first.move(mm=10)
    second.dwell(1)
    assert wire.now() - began > 3  # much longer than the watchdogs wait
    assert all(axis.status().enabled for axis in (first, second, third))
    second.disable()
    third.disable()
    asked = len(wire.nodes[1].executed)
    first.move(mm=0)
    assert len(wire.nodes[1].executed) == asked  # there is nothing to keep on
    first.prepare(mm=1)
    second.enable()
    second.prepare(mm=10)
    assert [status.position_nm for status in bus.start(first, second)] == [1e6, 1e7]


def test_another_node_that_no_longer_answers_does_not_end_a_motion():
    wire, bus = two_nodes()
    wire.nodes = wire.nodes[:1]
    assert bus.axis(1).move(mm=1).position_nm == 1e6
    with pytest.raises(NoAnswer, match="address 2"):
        bus.axis(2).status()


def test_none_of_two_nodes_starts_if_one_was_not_prepared():
    wire, bus = two_nodes()
    bus.axis(1).prepare(mm=1)
    with pytest.raises(Refused, match="the axis has no motion prepared"):
        bus.start(bus.axis(1), bus.axis(2))
    bus.sync()
    assert wire.nodes[0].state() == "prepared"


def test_a_node_that_misses_the_sync_is_named_and_the_others_are_stopped():
    wire, bus = two_nodes()
    for axis in (bus.axis(1), bus.axis(2)):
        axis.prepare(mm=1)
    unreachable, receive = wire.nodes[1], wire.nodes[1].port.receive
    unreachable.port.receive = lambda word: [] if word == 0x120 else receive(word)
    with pytest.raises(BusError, match="node 2 did not receive the sync"):
        bus.start(bus.axis(1), bus.axis(2))
    wire.wait(0.2)
    assert bus.axis(1).status().ended == bus.axis(2).status().ended == "stopped"
    assert unreachable.counters["syncs"] == 0
    bus.axis(2).prepare(mm=1)
    unreachable.port.receive = receive
    bus.sync()  # nothing waits for it
    assert unreachable.state() == "prepared"


def test_a_node_that_falls_silent_does_not_keep_the_others_from_being_stopped():
    wire, bus = two_nodes()
    chosen = [bus.axis(1), bus.axis(2), bus.axis(2, 1)]
    for axis in chosen:
        axis.set_parameter("watchdog_time", PATIENT)
        axis.prepare(mm=50)
    _, there = wire.nodes

    def fall_silent(status):
        wire.nodes = (there,)

    with pytest.raises(NoAnswer, match="address 1"):
        bus.start(*chosen, progress=fall_silent)
    assert [there.ended(axis) for axis in (0, 1)] == ["stopped", "stopped"]
    assert there.written("start_at_sync")[-1] == {"axes": 0}


def test_a_node_that_falls_silent_does_not_keep_the_other_drives_on():
    wire, bus = two_nodes()
    _, there = wire.nodes
    bus.axis(2, 1).set_parameter("watchdog_time", PATIENT)
    bus.axis(2, 1).begin_move(mm=50)
    wire.nodes = (there,)
    with pytest.raises(NoAnswer, match="address 1"):
        Machine(bus, Description()).close()
    assert [there.state(axis) for axis in (0, 1)] == ["off", "off"]
    assert there.ended(1) == "stopped" and wire.closed


def test_none_starts_if_one_was_not_prepared():
    wire, node = two_axes()
    node.axis(0).prepare("1mm")
    with pytest.raises(Refused, match="the axis has no motion prepared"):
        node.start(0, 1)
    assert wire.nodes[0].state() == "prepared"
    with pytest.raises(OutOfRange, match="no axis is given"):
        node.start()
    with pytest.raises(Refused, match="node 1 has no axis 2"):
        node.start(2)
    node.axis(0).stop()
    wire.wait(1)
    assert node.axis(0).status().ended == "stopped"


def test_an_interrupted_common_start_stops_all_of_them():
    wire, node = two_axes()
    for number in (0, 1):
        node.axis(number).prepare("50mm")

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        node.start(0, 1, progress=interrupt)
    assert [wire.nodes[0].ended(n) for n in (0, 1)] == ["stopped", "stopped"]

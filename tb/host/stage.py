# SPDX-License-Identifier: Apache-2.0
"""Axes for tests of the client: on a bus of simulated nodes, before and after homing."""

from moire.client.bus import Bus
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus


def stage(**node):
    """A bus, its node, and the first axis of the node, not homed."""
    wire = Rs485Bus(BusNode(**node))
    return wire, wire.nodes[0], Bus(wire).axis(wire.nodes[0].address)


def homed_stage():
    """The same with the drive on and the axis at its zero."""
    wire, node, axis = stage()
    axis.enable()
    axis.home()
    return wire, node, axis


def two_nodes():
    """A bus with the nodes 1 and 2, which have one and two axes, all homed."""
    wire = Rs485Bus(BusNode(1), BusNode(2, axes=2))
    bus = Bus(wire)
    for axis in (bus.axis(1), bus.axis(2), bus.axis(2, 1)):
        axis.enable()
        axis.home()
    return wire, bus

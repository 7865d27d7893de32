# SPDX-License-Identifier: Apache-2.0
"""Checks of a node that move nothing, each with its finding in words."""

from collections.abc import Iterator
from typing import NamedTuple

from moire import units
from moire.client.axis import Axis
from moire.client.node import Node
from moire.client.records import Status
from moire.client.values import ParameterValue
from moire.errors import MoireError
from moire.made.bus_tables import PARAMETERS
from moire.made.registers import MAP_CRC

EXCHANGES = 50  # in the check of the bus
CLOCK_S = 0.2  # duration of the check of the clock
BUS_ERRORS = ("frames_bad", "framing_errors", "start_glitches", "overruns")


class SelfTestFailed(MoireError):
    """At least one check found something."""


class Check(NamedTuple):
    """The result of one check."""

    name: str
    passed: bool
    words: str


def checks(node: Node) -> Iterator[Check]:
    """Carries out one check after the other."""
    yield from node_checks(node)
    for number in range(node.identity.axes):
        for check in axis_checks(node.axis(number)):
            yield check._replace(name=f"axis {number} {check.name}")


def node_checks(node: Node) -> Iterator[Check]:
    """The checks of a node without its axes. That it has the right build was checked when the Node
    was made.
    """
    identity = node.identity
    yield Check(
        "build",
        True,
        f"register map {identity.map_crc:08X}, protocol {identity.protocol_crc:08X}: as in this "
        "host",
    )
    yield bus_check(node)
    yield clock_check(node)


def bus_check(node: Node) -> Check:
    """Many exchanges; the node counts the errors of all hosts and nodes, not only of this one."""
    statistics, before = node.bus.statistics, node.counters()
    repeats, wrong = statistics.repeats, 0
    for _ in range(EXCHANGES):
        wrong += node.read_register(0) != MAP_CRC
    after = node.counters()
    found = {name: after[name] - before[name] for name in BUS_ERRORS if after[name] != before[name]}
    if statistics.repeats != repeats:
        found["repeats"] = statistics.repeats - repeats
    if wrong:
        found["wrong_values"] = wrong
    errors = ", ".join(f"{name} {count}" for name, count in found.items()) or "no error"
    return Check("bus", not found, f"{EXCHANGES} exchanges: {errors}")


def clock_check(node: Node) -> Check:
    """Compares with the clock of the transport; a simulated node may run slower than that."""
    transport = node.bus.transport
    first, began = node.read_named("node.time_stamp")["value"], transport.now()
    transport.wait(CLOCK_S)
    cycles = node.read_named("node.time_stamp")["value"] - first
    return Check(
        "clock",
        cycles > 0,
        f"{cycles / (transport.now() - began) / 1e6:.2f} MHz by this computer's clock, "
        f"{node.identity.clk_hz / 1e6:g} MHz by the node",
    )


def axis_checks(axis: Axis) -> Iterator[Check]:
    """The checks of one axis."""
    status, values = axis.status(), axis.parameters()
    yield interlock_check(status)
    yield switch_check(status)
    yield parameter_check(values)
    if values["position_source"].written() == "phases":
        yield signal_check(axis, values)
    else:
        yield count_check(axis, status)
    zero = "zero known" if status.homed else "not homed"
    yield Check("position", True, f"{units.format_length(status.position_nm)}, {zero}")


def interlock_check(status: Status) -> Check:
    """No fault is present, and the emergency stop is not pressed."""
    estop = "emergency stop pressed" if status.estop else ""
    words = ", ".join(filter(None, [status.fault_words, estop]))
    return Check("interlock", not words, words or "no fault, no emergency stop")


def switch_check(status: Status) -> Check:
    """Not both limit switches are pressed."""
    if status.limit_low and status.limit_high:
        return Check("switches", False, "both ends pressed: a wire is broken")
    ends = {"low end pressed": status.limit_low, "high end pressed": status.limit_high}
    pressed = [words for words, on in ends.items() if on]
    return Check("switches", True, pressed[0] if pressed else "free")


def parameter_check(values: dict[str, ParameterValue]) -> Check:
    """All parameters are inside their ranges."""
    outside = [
        name
        for name, known in PARAMETERS.items()
        if not known.min <= values[name].counts <= known.max
    ]
    words = f"out of range: {', '.join(outside)}" if outside else f"{len(values)}, all in range"
    return Check("parameters", not outside, words)


def signal_check(axis: Axis, values: dict[str, ParameterValue]) -> Check:
    """Sine and cosine have the right amplitude, and no fault."""
    amplitude, signal = axis.encoder().amplitude, axis.signal()
    low, high = (values[name].counts for name in ("amplitude_low", "amplitude_high"))
    return Check(
        "sensor",
        low <= amplitude <= high and not signal.faults,
        f"amplitude {amplitude}, allowed {low} to {high}; "
        f"{signal.fault_words or 'signal without fault'}",
    )


def count_check(axis: Axis, status: Status) -> Check:
    """The incremental encoder had no illegal edge."""
    illegal = "illegal_edge" in status.encoder_events
    words = "both quadrature levels changed at once" if illegal else "no illegal edge"
    built = "" if axis.has_sine() else "; built without sine and cosine"
    return Check("sensor", not illegal, words + built)

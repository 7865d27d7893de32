# SPDX-License-Identifier: Apache-2.0
"""What can be found wrong with a node without moving anything: checks, each with its finding in
words.
"""

from typing import NamedTuple

from moire import units
from moire.client.node import Node
from moire.errors import MoireError
from moire.made.bus_tables import PARAMETERS
from moire.made.registers import MAP_CRC

EXCHANGES = 50  # of the line check
CLOCK_S = 0.2  # of the clock check
BUS_ERRORS = ("frames_bad", "framing_errors", "start_glitches", "overruns")


class SelfTestFailed(MoireError):
    """At least one check found something."""


class Check(NamedTuple):
    name: str
    passed: bool
    words: str


def checks(node: Node):
    """Yields a Check after the other. That the node is of this build was checked when it was made."""
    yield Check(
        "build",
        True,
        f"register map {node.identity.map_crc:08X}, protocol {node.identity.protocol_crc:08X}: as in this host",
    )
    yield line_check(node)
    yield clock_check(node)
    for number in range(node.identity.axes):
        for check in axis_checks(node.axis(number)):
            yield check._replace(name=f"axis {number} {check.name}")


def line_check(node) -> Check:
    """Everybody's errors are counted, not only those of this host."""
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
    told = ", ".join(f"{name} {count}" for name, count in found.items()) or "no error"
    return Check("line", not found, f"{EXCHANGES} exchanges: {told}")


def clock_check(node) -> Check:
    """Against the clock of the transport; a simulated node may run slower than that."""
    transport = node.bus.transport
    first, began = node.read_named("node.time_stamp")["value"], transport.now()
    transport.wait(CLOCK_S)
    clk = node.read_named("node.time_stamp")["value"] - first
    return Check(
        "clock",
        clk > 0,
        f"{clk / (transport.now() - began) / 1e6:.2f} MHz by this computer's clock, "
        f"{node.identity.clk_hz / 1e6:g} MHz told",
    )


def axis_checks(axis):
    status = axis.status()
    yield Check(
        "guard",
        not status.faults and not status.estop,
        ", ".join(
            filter(None, [status.fault_words, "emergency stop pressed" if status.estop else ""])
        )
        or "no fault, no emergency stop",
    )
    both = status.limit_low and status.limit_high
    yield Check(
        "switches",
        not both,
        "both ends pressed: a wire is broken"
        if both
        else "low end pressed"
        if status.limit_low
        else "high end pressed"
        if status.limit_high
        else "free",
    )
    values = axis.parameters()
    out = [
        name
        for name, known in PARAMETERS.items()
        if not known.min <= values[name].counts <= known.max
    ]
    yield Check(
        "parameters",
        not out,
        f"out of range: {', '.join(out)}" if out else f"{len(values)}, all in range",
    )
    if values["position_source"].written() == "phases":
        amplitude, low, high = (
            axis.encoder().amplitude,
            values["amplitude_low"].counts,
            values["amplitude_high"].counts,
        )
        signal = axis.signal()
        yield Check(
            "sensor",
            low <= amplitude <= high and not signal.faults,
            f"amplitude {amplitude}, allowed {low} to {high}; {signal.fault_words or 'signal without fault'}",
        )
    else:
        illegal = "illegal_edge" in status.encoder_events
        yield Check(
            "sensor",
            not illegal,
            ("both quadrature levels changed at once" if illegal else "no illegal edge")
            + ("" if axis.has_sine() else "; built without sine and cosine"),
        )
    yield Check(
        "position",
        True,
        f"{units.format_length(status.position_nm)}, {'zero known' if status.homed else 'not homed'}",
    )

# SPDX-License-Identifier: Apache-2.0
"""How the parts of an axis reach the node: requests, registers, and the unit of positions."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

from moire import units
from moire.bus.transport import Transport
from moire.client.built import Built, feature_of, remedy
from moire.client.names import bit_names, code_name
from moire.client.records import Status
from moire.errors import Refused, with_more
from moire.made.bus_tables import CAUSES, ENCODER_EVENTS, FAULTS, FLAGS, PARAMETERS, STATES

if TYPE_CHECKING:
    from moire.client.node import Node

COUNTS = 65536  # counts on the bus in one signal period
FULL_SCALE = 32768  # counts of a drive command at full scale


class AxisAccess:
    """What all parts of an axis need. `period_nm` is the signal period of the encoder."""

    def __init__(self, node: Node, number: int):
        self.node, self.number = node, number
        self.period_nm = self.read_period()

    def read_period(self) -> Fraction:
        """The signal period in nm, from the node."""
        picometres = self.request("get_parameter", parameter=PARAMETERS["period"].id)["value"]
        return Fraction(picometres, 1000)

    @property
    def transport(self) -> Transport:
        """The transport of the bus."""
        return self.node.bus.transport

    def request(self, operation: str, **fields: int) -> dict[str, int]:
        """Sends a request for this axis. A refusal because of a fault names the fault, one because
        of something that is not built the parameter that builds it.
        """
        try:
            return self.node.request(operation, axis=self.number, **fields)
        except Refused as refused:
            if refused.cause in ("faulted", "fault_persists"):
                raise with_more(refused, self.status().fault_words or "no fault is left") from None
            feature = feature_of(operation, fields)
            if refused.cause == "not_built" and feature:
                raise with_more(refused, remedy(feature)) from None
            raise

    def built(self) -> Built:
        """What this axis was built with."""
        return Built(self.node.read_named("axis.built", self.number))

    def feedback(self, register: str) -> dict[str, int]:
        """The fields of a register of the feedback channel, in counts."""
        return self.node.read_named(f"feedback.{register}", self.number)

    def write_feedback(self, register: str, **counts: int) -> None:
        """Writes a whole register of the feedback channel."""
        try:
            self.node.write_named(f"feedback.{register}", self.number, **counts)
        except Refused as refused:
            if refused.cause != "not_built":
                raise
            compare = any(name.startswith("compare") for name in (register, *counts))
            raise with_more(refused, remedy("compare" if compare else "capture")) from None

    def to_nm(self, counts: int) -> float:
        """A length in nm from counts on the bus."""
        return length_of_counts(counts, self.period_nm)

    def to_counts(self, nm: units.Value) -> int:
        """The nearest counts on the bus of a length: a number in nm, or a text with a unit."""
        return round(units.parse_length(nm) * COUNTS / self.period_nm)

    def status(self) -> Status:
        """State, faults, position, target, velocity and drive command at one moment."""
        return status_of(self.request("status"), self.period_nm, self.node.identity.tick_hz)


def length_of_counts(counts: int, period_nm: Fraction) -> float:
    """A length in nm from counts on the bus."""
    return float(counts * period_nm / COUNTS)


def status_of(reply: Mapping[str, int], period_nm: Fraction, tick_hz: int) -> Status:
    """The status of an axis from the fields of the reply to `status`."""
    flags = bit_names(FLAGS, reply["flags"])
    return Status(
        state=code_name(STATES, reply["state"], "state"),
        ended=code_name(CAUSES, reply["ended"], "cause"),
        enabled="enabled" in flags,
        homed="homed" in flags,
        limit_low="limit_low" in flags,
        limit_high="limit_high" in flags,
        estop="estop" in flags,
        settled="settled" in flags,
        saturated="saturated" in flags,
        faults=bit_names(FAULTS, reply["faults"]),
        first_fault=bit_names(FAULTS, reply["first_fault"]),
        encoder_events=bit_names(ENCODER_EVENTS, reply["encoder_events"]),
        position_nm=length_of_counts(reply["position"], period_nm),
        target_nm=length_of_counts(reply["target"], period_nm),
        velocity_mm_s=length_of_counts(reply["velocity"], period_nm) * tick_hz / 1e6,
        drive_command=reply["command"] / FULL_SCALE,
        counts=reply["counts"],
    )

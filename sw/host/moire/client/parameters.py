# SPDX-License-Identifier: Apache-2.0
"""The parameters of an axis: read, check, set, save and load."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Protocol

from moire import units
from moire.client.access import AxisAccess
from moire.client.values import (
    CHOICES,
    FILTER,
    FILTERS,
    ParameterValue,
    counts_of,
    one_count,
    parameter,
    value_of,
)
from moire.errors import OutOfRange, Refused, with_more
from moire.made.bus_tables import PARAMETERS

TRAVEL = ("travel_low", "travel_high")
FEEDBACK = ("kd", "kp", "ki")  # in the order to raise them: what damps comes first
FEEDFORWARD = ("kv", "ka")
GAINS = (*FEEDBACK, *FEEDFORWARD)
# while one of these is on, the node refuses values of others: they are switched off first
OFF_FIRST = ("fine_reach", "segments")


class Tuning(Protocol):
    """Gains and filters of the servo in counts on the bus, as moire.analysis.tune makes them."""

    @property
    def kp(self) -> int:
        """Proportional gain."""

    @property
    def ki(self) -> int:
        """Integral gain."""

    @property
    def kd(self) -> int:
        """Derivative gain."""

    @property
    def kv(self) -> int:
        """Velocity feedforward."""

    @property
    def ka(self) -> int:
        """Acceleration feedforward."""

    @property
    def filters(self) -> Sequence[Sequence[int]]:
        """Coefficients of each filter, in the order of FILTER."""


class AxisParameters(AxisAccess):
    """The part of an axis that holds its parameters."""

    def parameter_value(
        self, name: str, counts: int, period_nm: Fraction | None = None
    ) -> ParameterValue:
        """The value in real units of so many counts."""
        known = parameter(name)
        return value_of(known, counts, one_count(known, period_nm or self.period_nm))

    def parameter_counts(
        self, name: str, value: units.Value, period_nm: Fraction | None = None
    ) -> int:
        """The counts on the bus of a value in real units; raises OutOfRange or UnknownName."""
        known = parameter(name)
        return counts_of(known, value, one_count(known, period_nm or self.period_nm))

    def get_parameter(self, name: str) -> ParameterValue:
        """Reads one parameter; raises UnknownName."""
        reply = self.request("get_parameter", parameter=parameter(name).id)
        return self.parameter_value(name, reply["value"])

    def set_parameter(self, name: str, value: units.Value) -> ParameterValue:
        """Sets one parameter and returns its new value, which is the nearest count.

        `value` is a number in the unit of get_parameter(), or a text with a unit. Raises
        UnknownName, OutOfRange, or Refused.
        """
        counts = self.parameter_counts(name, value)
        self.check_together({name: counts})
        return self.write_parameter(name, counts)

    def write_parameter(self, name: str, counts: int) -> ParameterValue:
        """Sets one parameter in counts; only the node checks the value."""
        try:
            self.request("set_parameter", parameter=parameter(name).id, value=counts)
        except Refused as refused:
            value = self.parameter_value(name, counts)
            raise with_more(refused, f"{name} {value.written(6)}") from None
        if name == "period":
            self.period_nm = self.read_period()
        return self.parameter_value(name, counts)

    def check_together(self, counts: Mapping[str, int], period_nm: Fraction | None = None) -> None:
        """Raises OutOfRange when these counts do not go together.

        A partner that is not among them is read from the node.
        """

        def pair(first: str, second: str) -> tuple[ParameterValue, ParameterValue] | None:
            if first not in counts and second not in counts:
                return None
            one, other = (
                self.parameter_value(name, counts[name], period_nm)
                if name in counts
                else self.get_parameter(name)
                for name in (first, second)
            )
            return one, other

        if (travel := pair(*TRAVEL)) and travel[1].counts < travel[0].counts:
            low, high = (value.written(9) for value in travel)
            raise OutOfRange(f"travel_high ({high}) would lie below travel_low ({low})")
        if travel is not None and period_nm in (None, self.period_nm):
            self.check_inside(*(value.value for value in travel))
        # the DAC is either the drive or that of the fine stage
        found = pair("drive", "fine_reach")
        if found and found[0].counts == CHOICES["drive"].index("dac") and found[1].counts:
            raise OutOfRange(f"drive dac and fine_reach {found[1].written(6)} do not go together")

    def check_inside(self, low: Fraction, high: Fraction) -> None:
        """Raises OutOfRange when a homed axis is outside this travel (nm), by more than a signal
        period: every motion would be refused, also the one that leads back.
        """
        status = self.status()
        at = Fraction(status.target_nm)
        if status.homed and not low - self.period_nm <= at <= high + self.period_nm:
            place, *ends = map(units.format_length, (at, low, high))
            raise OutOfRange(
                f"the axis is at {place}, outside a travel of {ends[0]} to {ends[1]}: move it "
                "inside first"
            )

    def parameters(self) -> dict[str, ParameterValue]:
        """All parameters, by name."""
        return {name: self.get_parameter(name) for name in PARAMETERS}

    def save_parameters(self) -> dict[str, str]:
        """All parameters as exact texts, ready for a JSON file."""
        return {name: value.written() for name, value in self.parameters().items()}

    def load_parameters(self, texts: Mapping[str, units.Value]) -> dict[str, ParameterValue]:
        """Sets some or all parameters from the texts of save_parameters().

        Every one is checked before the first is written.
        """
        return {
            name: self.write_parameter(name, counts)
            for name, counts in self.check_parameters(texts).items()
        }

    def check_parameters(self, texts: Mapping[str, units.Value]) -> dict[str, int]:
        """The counts of some or all parameters in the order to write them, without writing any.

        The period comes first, since lengths depend on it; then what is switched off and would
        forbid others; then all others in the order of the protocol. Raises OutOfRange or
        UnknownName when they cannot be loaded.
        """
        period_nm = self.period_nm
        if "period" in texts:
            period_nm = Fraction(self.parameter_counts("period", texts["period"]), 1000)
        counts = {name: self.parameter_counts(name, texts[name], period_nm) for name in texts}
        self.check_together(counts, period_nm)

        def turn(name: str) -> tuple[bool, bool, int]:
            off = name in OFF_FIRST and counts[name] == 0
            return name != "period", not off, PARAMETERS[name].id

        return {name: counts[name] for name in sorted(counts, key=turn)}

    def tuning(self) -> tuple[dict[str, int], tuple[tuple[int, ...], ...]]:
        """The gains of the servo by name, and the coefficients of each filter that is in use."""
        used = self.get_parameter("filters").counts
        filters = tuple(
            tuple(self.get_parameter(f"filter_{number + 1}_{name}").counts for name in FILTER)
            for number in range(FILTERS)
            if used >> number & 1
        )
        return {name: self.get_parameter(name).counts for name in GAINS}, filters

    def set_tuning(self, tuning: Tuning) -> None:
        """Sets the gains and filters that moire.analysis.tune made; the drive may be on.

        The filters change while each feedback gain is the smaller one of its old and its new value,
        and the new gains come last. The new filters are written where none is in use, and then
        replace the old ones at once. If there is no room, the old ones are switched off first.
        """
        if len(tuning.filters) > FILTERS:
            raise OutOfRange(f"the servo has {FILTERS} filters, the tuning {len(tuning.filters)}")
        for name in reversed(FEEDBACK):
            old = self.get_parameter(name).counts
            self.write_parameter(name, min(old, getattr(tuning, name)))
        used = self.get_parameter("filters").counts
        free = [number for number in range(FILTERS) if not used >> number & 1]
        if len(free) < len(tuning.filters):
            self.write_parameter("filters", 0)
            free = list(range(FILTERS))
        chosen = dict(zip(free, tuning.filters))
        for number, coefficients in chosen.items():
            for name, value in zip(FILTER, coefficients, strict=True):
                self.write_parameter(f"filter_{number + 1}_{name}", value)
        self.write_parameter("filters", sum(1 << number for number in chosen))
        for name in (*FEEDBACK, *FEEDFORWARD):
            self.write_parameter(name, getattr(tuning, name))

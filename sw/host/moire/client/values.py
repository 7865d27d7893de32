# SPDX-License-Identifier: Apache-2.0
"""Parameters and settings: from text and real units to the counts on the bus, and back."""

import re
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from moire import units
from moire.errors import OutOfRange, UnknownName
from moire.made.bus_tables import PARAMETERS, SETTINGS, Parameter

FILTERS = 2  # of the servo
FILTER = ("b0", "b1", "b2", "a1", "a2")  # coefficients of a filter

# names of the values of a parameter or setting that is a choice, from 0 on
CHOICES = {
    "home_end": ("low", "high"),
    "auto_calibration": ("frozen", "calibrates", "follows"),
    "decoder_mode": ("every_edge", "every_second", "every_fourth", "pulses"),
    "position_source": ("phases", "counts", "own_steps"),
    "drive": ("bridge", "steps", "dac"),
    "step_output": ("step_and_direction", "quadrature", "pulses"),
    "step_invert": ("none", "step", "direction", "both"),
    "filters": ("none", "first", "second", "both"),
    "segments": ("off", "rectangle", "linear"),
    "index_gate": ("any", "both_low", "a_high", "both_high", "b_high"),
    "turn_direction": ("direct", "shorter", "up"),
    "peer_mode": ("off", "legacy", "frames"),
    "peer_role": ("main", "sub"),
}
HOME_METHODS = {"s0": -1, "s3": -2}  # beside the numbers of CiA 402

# unit in bus.toml: the quantity that people write; what that unit is worth in the base unit, with
# the signal period taken as 1 nm; whether it must then be multiplied by the signal period
KINDS = {
    "pm": (units.LENGTH, Fraction(1, 1000), False),
    "period": (units.LENGTH, Fraction(1), True),
    "period/s": (units.SPEED, Fraction(1, 10**6), True),
    "period/s2": (units.ACCELERATION, Fraction(1, 10**6), True),
    "period/s3": (units.JERK, Fraction(1, 10**6), True),
    "s": (units.TIME, Fraction(1), False),
    "Hz": (units.FREQUENCY, Fraction(1), False),
    "arcsec": (units.ANGLE, Fraction(1), False),
    "": (units.NUMBER, Fraction(1), False),
}


@dataclass(frozen=True)
class ParameterValue:
    """The value of a parameter or setting, and what it may be. All values are exact."""

    name: str
    id: int
    counts: int  # on the bus
    value: Fraction  # in `unit`
    unit: str
    minimum: Fraction
    maximum: Fraction
    default: Fraction
    text: str  # purpose of the parameter
    quantity: units.Quantity = field(repr=False)

    def written(self, digits: int | None = None) -> str:
        """The value as set_parameter() takes it; exact unless `digits` are given."""
        if self.name in CHOICES:
            return CHOICES[self.name][self.counts]
        return units.with_unit(self.quantity, self.value, digits)

    @property
    def is_default(self) -> bool:
        """Whether it has the value after power-up of a node without saved values."""
        return self.value == self.default

    @property
    def default_written(self) -> str:
        """The default, written as written() writes the value."""
        counts = (PARAMETERS | SETTINGS)[self.name].default
        return replace(self, counts=counts, value=self.default).written()

    def values(self) -> dict[str, Any]:
        """The value for JSON, with its range and its meaning."""
        return {
            "name": self.name,
            "value": float(self.value),
            "unit": self.unit,
            "written": self.written(),
            "minimum": float(self.minimum),
            "maximum": float(self.maximum),
            "default": float(self.default),
            "text": self.text,
        }

    @property
    def range_words(self) -> str:
        """The allowed values: "0nm to 5mm", or the choices."""
        if self.name in CHOICES:
            return ", ".join(CHOICES[self.name])
        return " to ".join(
            units.with_unit(self.quantity, end, 6) for end in (self.minimum, self.maximum)
        )


def whole(value: object) -> bool:
    """Whether a value (of a JSON file) is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)


def parameter(name: str) -> Parameter:
    """The entry of the protocol table; raises UnknownName."""
    if name not in PARAMETERS:
        raise UnknownName(f"there is no parameter '{name}': known are {', '.join(PARAMETERS)}")
    return PARAMETERS[name]


def one_count(known: Parameter, period_nm: Fraction) -> Fraction:
    """What one count is worth in the base unit of the quantity."""
    _, worth, periodic = KINDS[known.unit]
    return known.lsb * worth * (period_nm if periodic else 1)


def value_of(known: Parameter, counts: int, one: Fraction) -> ParameterValue:
    """The value of so many counts, where one count is worth `one`."""
    quantity = KINDS[known.unit][0]
    return ParameterValue(
        known.name,
        known.id,
        counts,
        counts * one,
        quantity.base,
        known.min * one,
        known.max * one,
        known.default * one,
        known.text,
        quantity,
    )


def counts_of(known: Parameter, value: units.Value, one: Fraction) -> int:
    """The counts of a value in real units, where one count is worth `one`; raises OutOfRange."""
    if isinstance(value, str) and (chosen := choice(known.name, value)) is not None:
        return chosen
    quantity = KINDS[known.unit][0]
    exact = quantity.parse(value)
    counts = round(exact / one)
    if not known.min <= counts <= known.max:
        allowed = value_of(known, known.default, one).range_words
        raise OutOfRange(
            f"{known.name} allows {allowed}, not {units.with_unit(quantity, exact, 6)}"
        )
    if known.lsb == 1 and not known.unit and exact != counts:
        raise OutOfRange(f"{known.name} takes whole numbers, not {units.decimal(exact)}")
    return counts


def choice(name: str, text: str) -> int | None:
    """The counts of a named choice; None where `text` is a number and a number may be written."""
    word = text.strip()
    if name == "home_method" and word in HOME_METHODS:
        return HOME_METHODS[word]
    if name == "feed_override" and word.endswith("%"):
        return round(units.parse_share(text) / PARAMETERS[name].lsb)
    if name not in CHOICES or re.fullmatch(r"\s*[+-]?[0-9.]+\s*", text):
        return None
    if word not in CHOICES[name]:
        raise OutOfRange(f"{name} is no '{word}': allowed are {', '.join(CHOICES[name])}")
    return CHOICES[name].index(word)

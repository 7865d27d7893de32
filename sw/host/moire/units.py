# SPDX-License-Identifier: Apache-2.0
"""Lengths, speeds, times and other quantities: from text such as "1.5mm", "5mm/s" or "20ms" to
exact fractions, and back.
"""

import re
from collections.abc import Mapping
from fractions import Fraction

from moire.errors import UnitError

Number = int | float | Fraction
Value = str | Number  # a text with a unit, or a number in the base unit of the quantity

SPELLINGS = str.maketrans(
    {
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        "\N{SUPERSCRIPT TWO}": "2",
        "\N{SUPERSCRIPT THREE}": "3",
    }
)

LENGTHS = {
    "pm": Fraction(1, 1000),
    "nm": Fraction(1),
    "um": Fraction(1000),
    "mm": Fraction(10**6),
    "cm": Fraction(10**7),
    "m": Fraction(10**9),
}
TIMES = {
    "ns": Fraction(1, 10**9),
    "us": Fraction(1, 10**6),
    "ms": Fraction(1, 1000),
    "s": Fraction(1),
    "min": Fraction(60),
    "h": Fraction(3600),
}
ANGLES = {"arcsec": Fraction(1), "arcmin": Fraction(60), "deg": Fraction(3600)}
FREQUENCIES = {"Hz": Fraction(1), "kHz": Fraction(1000), "MHz": Fraction(10**6)}


NUMBER_AND_UNIT = re.compile(
    r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"
    r"\s*([A-Za-z]*(?:/[A-Za-z]+\^?[0-9]?)?)"
)


def over_seconds(power: str) -> dict[str, Fraction]:
    """The units of length over s, s2 or s3, each worth so many mm/s, mm/s2 or mm/s3."""
    return {f"{name}/{power}": worth / LENGTHS["mm"] for name, worth in LENGTHS.items()}


class Quantity:
    """One kind of quantity: its base unit, and what each unit is worth in the base unit."""

    def __init__(self, name: str, base: str, worth: Mapping[str, Fraction], example: str):
        self.name, self.base, self.worth, self.example = name, base, worth, example

    def allowed(self) -> str:
        """What may be written, for an error."""
        first = "a plain number" if not self.worth else f"a number with {' '.join(self.worth)}"
        return f"{first}, such as {self.example}"

    def parse(self, value: Value) -> Fraction:
        """The value in the base unit; a number is in the base unit already.

        Raises UnitError for anything else, also for a text without a unit unless it is zero.
        """
        if not isinstance(value, str):
            try:
                return Fraction(value)
            except (TypeError, ValueError, OverflowError):
                raise UnitError(f"{value!r} is no {self.name}: write {self.allowed()}") from None
        found = NUMBER_AND_UNIT.fullmatch(value.strip().translate(SPELLINGS))
        if found is None:
            raise UnitError(f"'{value}' is no {self.name}: write {self.allowed()}")
        number, unit = Fraction(found[1]), found[2].replace("^", "")
        if not unit and (number == 0 or not self.worth):
            return number
        if not unit:
            raise UnitError(f"'{value}' has no unit: write {self.allowed()}")
        if unit in self.worth:
            return number * self.worth[unit]
        raise UnitError(f"'{value}' is no {self.name}: write {self.allowed()}")


LENGTH = Quantity("length", "nm", LENGTHS, "1.5mm or 50nm")
SPEED = Quantity("speed", "mm/s", over_seconds("s"), "5mm/s")
ACCELERATION = Quantity("acceleration", "mm/s2", over_seconds("s2"), "100mm/s2")
JERK = Quantity("jerk", "mm/s3", over_seconds("s3"), "10000mm/s3")
TIME = Quantity("time", "s", TIMES, "20ms")
FREQUENCY = Quantity("frequency", "Hz", FREQUENCIES, "20kHz")
ANGLE = Quantity("angle", "arcsec", ANGLES, "12.5deg or 0.5arcsec")
NUMBER = Quantity("number", "", {}, "0.5")


def parse_length(value: Value) -> Fraction:
    """In nm; raises UnitError."""
    return LENGTH.parse(value)


def parse_speed(value: Value) -> Fraction:
    """In mm/s; raises UnitError."""
    return SPEED.parse(value)


def parse_angle(value: Value) -> Fraction:
    """In arcsec; raises UnitError."""
    return ANGLE.parse(value)


def parse_time(value: Value) -> Fraction:
    """In s; raises UnitError."""
    return TIME.parse(value)


def parse_number(value: Value) -> Fraction:
    """Without a unit; raises UnitError."""
    return NUMBER.parse(value)


def parse_signed_share(value: Value) -> Fraction:
    """A fraction, from "-50%" or -0.5; raises UnitError."""
    plain = value.strip() if isinstance(value, str) else value
    if isinstance(plain, str) and plain.endswith("%"):
        return NUMBER.parse(plain[:-1]) / 100
    return NUMBER.parse(plain)


def parse_share(value: Value) -> Fraction:
    """A fraction of full speed, from "50%" or 0.5; raises UnitError below 0 and above 1."""
    share = parse_signed_share(value)
    if not 0 <= share <= 1:
        raise UnitError(f"'{value}' is no share of full speed: write 0% to 100%, or 0 to 1")
    return share


def decimal(value: Number) -> str:
    """All digits of a fraction; 15 decimals where it has endlessly many."""
    value = Fraction(value)
    remainder, twos, fives = value.denominator, 0, 0
    while remainder % 2 == 0:
        remainder, twos = remainder // 2, twos + 1
    while remainder % 5 == 0:
        remainder, fives = remainder // 5, fives + 1
    decimals = max(twos, fives) if remainder == 1 else 15
    digits = str(abs(round(value * 10**decimals))).rjust(decimals + 1, "0")
    whole, part = (digits[:-decimals], digits[-decimals:]) if decimals else (digits, "")
    part = part.rstrip("0")
    return ("-" if value < 0 else "") + whole + ("." + part if part else "")


def rounded(value: Number, digits: int) -> str:
    """A number with so many significant digits, without an exponent and without trailing zeros."""
    value = Fraction(value)
    if value == 0:
        return "0"
    decimals = digits - 1
    magnitude = abs(value)
    while magnitude >= 10:
        magnitude, decimals = magnitude / 10, decimals - 1
    while magnitude < 1:
        magnitude, decimals = magnitude * 10, decimals + 1
    return decimal(Fraction(round(value * Fraction(10) ** decimals)) / Fraction(10) ** decimals)


def with_unit(quantity: Quantity, value: Number, digits: int | None = None) -> str:
    """A value in the base unit as text, exact unless `digits` are given.

    The unit is the largest one that leaves a digit before the point; cm, m, min and h are not used.
    """
    value = Fraction(value)
    unit, worth = quantity.base, Fraction(1)
    candidates = [
        item
        for item in quantity.worth.items()
        if not item[0].startswith(("cm", "min", "h")) and not re.match(r"m(/|$)", item[0])
    ]
    if value and candidates:
        fitting = [item for item in candidates if abs(value) >= item[1]]
        if fitting:
            unit, worth = max(fitting, key=lambda item: item[1])
        else:
            unit, worth = min(candidates, key=lambda item: item[1])
    number = decimal(value / worth) if digits is None else rounded(value / worth, digits)
    return number + unit


def format_length(nm: Number, digits: int | None = 9) -> str:
    """A length in nm as text."""
    return with_unit(LENGTH, nm, digits)


def format_speed(mm_per_s: Number, digits: int | None = 6) -> str:
    """A speed in mm/s as text."""
    return with_unit(SPEED, mm_per_s, digits)


def format_time(s: Number, digits: int | None = 6) -> str:
    """A time in s as text."""
    return with_unit(TIME, s, digits)

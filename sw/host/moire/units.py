# SPDX-License-Identifier: Apache-2.0
"""Lengths, speeds and times as people write them ("1.5mm", "5mm/s", "20ms") and as exact fractions."""

import re
from fractions import Fraction

from .errors import UnitError

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
}
ANGLES = {"arcsec": Fraction(1), "arcmin": Fraction(60), "deg": Fraction(3600)}
FREQUENCIES = {"Hz": Fraction(1), "kHz": Fraction(1000), "MHz": Fraction(10**6)}


def over_seconds(power: str) -> dict:
    """Lengths over s, s2 or s3, worth in mm/s…"""
    return {f"{name}/{power}": worth / LENGTHS["mm"] for name, worth in LENGTHS.items()}


class Quantity:
    """What may be written: units and what each is worth in the base unit."""

    def __init__(self, name, base, worth, written):
        self.name, self.base, self.worth, self.written = name, base, worth, written

    def allowed(self) -> str:
        first = "a plain number" if not self.worth else f"a number with {' '.join(self.worth)}"
        return f"{first}, such as {self.written}"

    def parse(self, text) -> Fraction:
        """The value in the base unit. Numbers that are no text are in the base unit already."""
        if not isinstance(text, str):
            try:
                return Fraction(text)
            except (TypeError, ValueError, OverflowError):
                raise UnitError(f"{text!r} is no {self.name}: write {self.allowed()}") from None
        plain = text.strip().translate(SPELLINGS)
        found = re.fullmatch(
            r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)\s*([A-Za-z]*(?:/[A-Za-z]+\^?[0-9]?)?)",
            plain,
        )
        if found is None:
            raise UnitError(f"'{text}' is no {self.name}: write {self.allowed()}")
        number, unit = Fraction(found[1]), found[2].replace("^", "")
        if not unit and (number == 0 or not self.worth):
            return number
        if not unit:
            raise UnitError(f"'{text}' has no unit: write {self.allowed()}")
        if unit in self.worth:
            return number * self.worth[unit]
        raise UnitError(f"'{text}' is no {self.name}: write {self.allowed()}")


LENGTH = Quantity("length", "nm", LENGTHS, "1.5mm or 50nm")
SPEED = Quantity("speed", "mm/s", over_seconds("s"), "5mm/s")
ACCELERATION = Quantity("acceleration", "mm/s2", over_seconds("s2"), "100mm/s2")
JERK = Quantity("jerk", "mm/s3", over_seconds("s3"), "10000mm/s3")
TIME = Quantity("time", "s", TIMES, "20ms")
FREQUENCY = Quantity("frequency", "Hz", FREQUENCIES, "20kHz")
ANGLE = Quantity("angle", "arcsec", ANGLES, "12.5deg or 0.5arcsec")
NUMBER = Quantity("number", "", {}, "0.5")


def parse_length(text) -> Fraction:
    """In nm."""
    return LENGTH.parse(text)


def parse_speed(text) -> Fraction:
    """In mm/s."""
    return SPEED.parse(text)


def parse_angle(text) -> Fraction:
    """In arcsec."""
    return ANGLE.parse(text)


def parse_time(text) -> Fraction:
    """In s."""
    return TIME.parse(text)


def parse_share(text) -> Fraction:
    """Of the whole: "50%" or 0.5."""
    plain = text.strip() if isinstance(text, str) else text
    share = (
        NUMBER.parse(plain[:-1]) / 100
        if isinstance(plain, str) and plain.endswith("%")
        else NUMBER.parse(plain)
    )
    if not 0 <= share <= 1:
        raise UnitError(f"'{text}' is no share of full speed: write 0% to 100%, or 0 to 1")
    return share


def decimal(value) -> str:
    """Every digit of a fraction; of one without an end, 15 places."""
    value = Fraction(value)
    rest, twos, fives = value.denominator, 0, 0
    while rest % 2 == 0:
        rest, twos = rest // 2, twos + 1
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    places = max(twos, fives) if rest == 1 else 15
    digits = str(abs(round(value * 10**places))).rjust(places + 1, "0")
    whole, part = (digits[:-places], digits[-places:].rstrip("0")) if places else (digits, "")
    return ("-" if value < 0 else "") + whole + ("." + part if part else "")


def rounded(value, digits: int) -> str:
    """So many significant digits, never with an exponent, no idle zeros."""
    value = Fraction(value)
    if value == 0:
        return "0"
    places = digits - 1
    magnitude = abs(value)
    while magnitude >= 10:
        magnitude, places = magnitude / 10, places - 1
    while magnitude < 1:
        magnitude, places = magnitude * 10, places + 1
    return decimal(Fraction(round(value * Fraction(10) ** places)) / Fraction(10) ** places)


def with_unit(quantity: Quantity, value, digits: int | None = None) -> str:
    """The value (in the base unit) with the largest unit that leaves a digit before the point;
    exact unless digits are given.
    """
    value = Fraction(value)
    unit, worth = quantity.base, Fraction(1)
    candidates = [
        item
        for item in quantity.worth.items()
        if not item[0].startswith(("cm", "min")) and not re.match(r"m(/|$)", item[0])
    ]
    if value and candidates:
        fitting = [item for item in candidates if abs(value) >= item[1]]
        unit, worth = (
            max(fitting, key=lambda item: item[1])
            if fitting
            else min(candidates, key=lambda item: item[1])
        )
    number = decimal(value / worth) if digits is None else rounded(value / worth, digits)
    return number + unit


def format_length(nm, digits: int | None = 9) -> str:
    return with_unit(LENGTH, nm, digits)


def format_speed(mm_per_s, digits: int | None = 6) -> str:
    return with_unit(SPEED, mm_per_s, digits)


def format_time(s, digits: int | None = 6) -> str:
    return with_unit(TIME, s, digits)

# SPDX-License-Identifier: Apache-2.0
"""Values with the units of the machines' parameters (sw/twin/parameters): from text such as
"0.3 um", "2 %" or "5 ppm" to numbers in the unit of the parameter, and back.
"""

import math
import re
from collections.abc import Mapping

from moire.errors import UnitError
from moire.units import SPELLINGS

PREFIXES = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6}
NO_PREFIX = ("rad", "degree", "LSB")  # the others of these are written out below
SHARE = "of"  # the units of shares begin with it: "of the torque"
ARC = 180 / 3.141592653589793
OTHERS: Mapping[str, Mapping[str, float]] = {  # {unit: {another one: its worth}}
    SHARE: {"%": 1e-2},
    "degree": {"deg": 1.0, "arcmin": 1 / 60, "arcsec": 1 / 3600},
    "rad": {
        "mrad": 1e-3,
        "urad": 1e-6,
        "deg": 1 / ARC,
        "arcmin": 1 / ARC / 60,
        "arcsec": 1 / ARC / 3600,
    },
    "m/m": {"ppm": 1e-6, "%": 1e-2},
    "1/K": {"ppm/K": 1e-6},
}
NUMBER_AND_UNIT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*)")


def short(unit: str) -> str:
    """The first word of the unit of a parameter; the others say of what or where it is."""
    return unit.split()[0]


def place(unit: str) -> str:
    """The words of the unit that say of what or where, with a semicolon: 'at 120 mm; '."""
    words = unit if short(unit) == SHARE else unit.partition(" ")[2]
    return f"{words}; " if words else ""


def worths(unit: str) -> dict[str, float]:
    """{what may be written: its worth in the unit of the parameter}"""
    base = short(unit)
    if base == SHARE:
        return {"": 1.0, **OTHERS[SHARE]}
    found = {base: 1.0, **OTHERS.get(base, {})}
    if base not in NO_PREFIX and base[0].isalpha():
        found |= {prefix + base: worth for prefix, worth in PREFIXES.items()}
    return found


def allowed(unit: str) -> str:
    """What may be written, for an error."""
    names = [name or "no unit" for name in worths(unit)]
    return f"a number with {', '.join(names)}"


def parse(value: object, unit: str) -> float:
    """The value in the unit of the parameter; raises UnitError. A plain number is a share."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise UnitError(f"{value!r} is no value: write {allowed(unit)}")
    text = value if isinstance(value, str) else repr(value)
    found = NUMBER_AND_UNIT.fullmatch(text.strip().translate(SPELLINGS))
    if not found:
        raise UnitError(f"'{text}' is no value: write {allowed(unit)}")
    number, written = float(found[1]), found[2]
    worth = worths(unit).get(written)
    if worth is None and not written:
        raise UnitError(f"{text} has no unit: write {allowed(unit)}")
    if worth is None:
        raise UnitError(f"'{text}' has the unit '{written}': write {allowed(unit)}")
    if math.isinf(number):
        raise UnitError(f"'{text}' is too large")
    return number * worth


def text_of(value: float, unit: str) -> str:
    """A value as it may be written in a study, with a prefix that leaves few zeros."""
    base = short(unit)
    if base == SHARE:
        return f"{value:g}"
    prefixes = {prefix: worths(unit).get(prefix + base) for prefix in ("", *PREFIXES)}
    fitting = [
        (worth, prefix) for prefix, worth in prefixes.items() if worth and worth <= abs(value)
    ]
    worth, prefix = max(fitting) if fitting else (1.0, "")
    return f"{value / worth:g} {prefix}{base}"

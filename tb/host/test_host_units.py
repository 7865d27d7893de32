# SPDX-License-Identifier: Apache-2.0
"""moire.units: known values, refusals with what is allowed, and random values written and read
back.
"""

import random
from fractions import Fraction

import pytest

from moire import units
from moire.errors import UnitError
from tb.bench import seed

SEED = seed()


@pytest.mark.parametrize(
    "text, nm",
    [
        ("1.5mm", 1_500_000),
        ("200um", 200_000),
        ("200\N{MICRO SIGN}m", 200_000),
        ("200\N{GREEK SMALL LETTER MU}m", 200_000),
        ("50nm", 50),
        ("-50 nm", -50),
        ("+.5nm", Fraction(1, 2)),
        ("1e-3mm", 1000),
        ("12pm", Fraction(12, 1000)),
        ("3cm", 30_000_000),
        ("0.12m", 120_000_000),
        ("0", 0),
        (" 2.nm ", 2),
        (7.5, Fraction(15, 2)),
    ],
)
def test_a_length_is_read_exactly(text, nm):
    assert units.parse_length(text) == nm


@pytest.mark.parametrize(
    "text",
    [
        "",
        "mm",
        "1.5",
        "1,5mm",
        "1.5 Mm",
        "1.5MM",
        "1mm/s",
        "one mm",
        "1mm 2",
        "--1mm",
        "nan",
        "infnm",
        "1e9999nm",
        None,
        float("nan"),
        float("inf"),
    ],
)
def test_what_is_no_length_is_refused_with_what_is_allowed(text):
    with pytest.raises(UnitError, match="pm nm um mm cm m, such as 1.5mm or 50nm"):
        units.parse_length(text)


def test_speeds_accelerations_and_times_are_read():
    assert units.parse_speed("5mm/s") == 5
    assert units.parse_speed("200 um/s") == Fraction(1, 5)
    assert units.ACCELERATION.parse("0.1m/s^2") == 100
    assert units.ACCELERATION.parse("100mm/s\N{SUPERSCRIPT TWO}") == 100
    assert units.JERK.parse("1m/s3") == 1000
    assert units.parse_time("20ms") == Fraction(1, 50)
    assert units.FREQUENCY.parse("20kHz") == 20000
    assert units.NUMBER.parse("0.25") == Fraction(1, 4)


@pytest.mark.parametrize(
    "quantity, text, value",
    [
        (units.TIME, "1ns", Fraction(1, 1_000_000_000)),
        (units.TIME, "1us", Fraction(1, 1_000_000)),
        (units.TIME, "1ms", Fraction(1, 1000)),
        (units.TIME, "1s", 1),
        (units.ANGLE, "1arcsec", 1),
        (units.ANGLE, "1arcmin", 60),
        (units.ANGLE, "1deg", 3600),
        (units.FREQUENCY, "1Hz", 1),
        (units.FREQUENCY, "1kHz", 1000),
        (units.FREQUENCY, "1MHz", 1_000_000),
    ],
)
def test_each_unit_has_its_worth(quantity, text, value):
    assert quantity.parse(text) == value


def test_a_wrong_speed_is_refused_with_what_is_allowed():
    with pytest.raises(
        UnitError,
        match=r"'5mm' is no speed: write a number with pm/s nm/s um/s mm/s cm/s m/s, such as 5mm/s",
    ):
        units.parse_speed("5mm")


def test_numbers_are_written_as_people_read_them():
    assert units.format_length(1_500_000) == "1.5mm"
    assert units.format_length(-200) == "-200nm"
    assert units.format_length(0) == "0nm"
    assert units.format_length(Fraction(1, 10)) == "100pm"
    assert units.format_length(999) == "999nm"
    assert units.format_length(1000) == "1um"
    assert units.format_length(123456789.25, 6) == "123.457mm"
    assert units.format_length(Fraction(1234567894, 1000)) == "1.23456789mm"
    assert units.format_length(Fraction(1, 20000)) == "0.05pm"
    assert units.format_speed(Fraction(48, 10)) == "4.8mm/s"
    assert units.format_speed(Fraction(12345678, 10**7)) == "1.23457mm/s"
    assert units.format_time(Fraction(12345678, 10**7)) == "1.23457s"
    assert units.format_time(Fraction(1, 50)) == "20ms"
    assert units.decimal(Fraction(1, 65536)) == "0.0000152587890625"
    assert units.decimal(Fraction(-5, 4)) == "-1.25"
    assert units.decimal(100) == "100"
    assert units.decimal(Fraction(1, 125)) == "0.008"
    assert units.decimal(Fraction(1, 3)) == "0.333333333333333"
    assert units.rounded(Fraction(2, 3), 3) == "0.667"
    assert units.rounded(1999999, 3) == "2000000"
    assert units.rounded(104, 2) == "100"
    assert units.rounded(95, 2) == "95"
    assert units.rounded(Fraction(2, 300), 3) == "0.00667"
    assert units.rounded(Fraction(912345, 10**9), 3) == "0.000912"


@pytest.mark.parametrize(
    "quantity",
    [
        units.LENGTH,
        units.SPEED,
        units.ACCELERATION,
        units.JERK,
        units.TIME,
        units.FREQUENCY,
        units.NUMBER,
    ],
    ids=lambda q: q.name,
)
def test_any_value_is_restored_from_its_exact_text(quantity):
    print("SEED", SEED)
    source = random.Random(SEED)
    for _ in range(500):
        value = Fraction(source.randrange(-(2**48), 2**48), 2 ** source.randrange(40)) * Fraction(
            10
        ) ** source.randrange(-6, 7)
        text = units.with_unit(quantity, value)
        assert quantity.parse(text) == value, text


def test_any_text_is_a_value_or_a_clear_refusal():
    print("SEED", SEED)
    source, refusals = random.Random(SEED), []
    for _ in range(3000):
        text = "".join(
            source.choice("0123456789.-+eE munp/s ") for _ in range(source.randrange(1, 9))
        )
        try:
            units.parse_length(text)
        except UnitError as refused:
            refusals.append(str(refused))
    assert 0 < len(refusals) < 3000 and all("such as" in words for words in refusals)


@pytest.mark.parametrize(
    "text, share",
    [
        ("50%", Fraction(1, 2)),
        ("0%", 0),
        ("100 %", 1),
        ("0.25", Fraction(1, 4)),
        (1, 1),
        (0.5, Fraction(1, 2)),
    ],
)
def test_a_share_is_a_percentage_or_a_fraction(text, share):
    assert units.parse_share(text) == share


@pytest.mark.parametrize("text", ["101%", "-0.1", 2, "half", "%", "5mm"])
def test_what_is_no_share_is_refused(text):
    with pytest.raises(UnitError):
        units.parse_share(text)


def test_long_times_are_read_in_minutes_and_hours_and_printed_in_seconds():
    assert units.parse_time("4h") == 14400 and units.parse_time("90min") == 5400
    assert units.format_time(14400) == "14400s"

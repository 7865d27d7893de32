# SPDX-License-Identifier: Apache-2.0
"""The types of the values on the command line. Each refuses a wrong text in one sentence."""

import re
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from fractions import Fraction
from typing import Any

import click
from click.shell_completion import CompletionItem

from moire import units
from moire.bus.protocol import ADDRESSES
from moire.client.values import HOME_METHODS
from moire.errors import MoireError, OutOfRange, UnitError

MARK = " "  # in front of a value below zero, so that click takes it for no option
MOST_NAMES = 12  # a longer list of names is not printed in an error


def marked(argument: str) -> str:
    """The argument, which click must not take for an option if it is a number below zero."""
    return MARK + argument if re.match(r"-[0-9.]", argument) else argument


class Value(click.ParamType[Any]):
    """A value that a function makes from the text."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self.parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value; a MoireError of the function becomes a usage error."""
        if not isinstance(value, str):
            return value
        try:
            return self.parse(value.removeprefix(MARK))
        except MoireError as error:
            self.fail(str(error), param, ctx)


class Name(Value):
    """One of some known names."""

    def __init__(self, what: str, known: Iterable[str], listed_by: str = "--help") -> None:
        self.what, self.known, self.listed_by = what, tuple(known), listed_by
        super().__init__(what, self.look_up)

    def look_up(self, text: str) -> str:
        """The name itself, or OutOfRange with the names that look like it."""
        if text not in self.known:
            raise OutOfRange(unknown(self.what, text, self.known, self.listed_by))
        return text

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        """The names that begin with what has been typed."""
        return [CompletionItem(name) for name in self.known if name.startswith(incomplete)]


class File(Value):
    """The path of a file. The shell completes it."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        """Leave the completion to the shell, which knows the files."""
        return [CompletionItem(incomplete, type="file")]


def near_names(name: str, known: Iterable[str]) -> list[str]:
    """The known names that look like a name."""
    return get_close_matches(name, known)


def did_you_mean(near: Sequence[str]) -> str:
    """The end of a sentence about a name that does not exist; empty if no name looks like it."""
    if not near:
        return ""
    *others, last = near
    return f", did you mean {', '.join(others)}{' or ' if others else ''}{last}?"


def unknown(what: str, name: str, known: Iterable[str], listed_by: str) -> str:
    """The sentence about a name that does not exist. `listed_by` is the command that lists all."""
    names = tuple(known)
    more = did_you_mean(near_names(name, names))
    if not more and len(names) <= MOST_NAMES:
        more = f": allowed are {', '.join(names)}"
    return f"there is no {what} '{name}'" + (more or f": 'moire {listed_by}' lists all")


def whole(low: int, high: int | None, sentence: str) -> Callable[[str], int]:
    """A function that reads a whole number within limits."""

    def parse(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = low - 1
        if number < low or (high is not None and number > high):
            raise OutOfRange(f"'{text.strip()}' {sentence}")
        return number

    return parse


def number(text: str) -> float:
    """A plain number."""
    try:
        return float(text)
    except ValueError:
        raise UnitError(f"'{text.strip()}' is no number") from None


def above_zero(parse: Callable[[str], Fraction]) -> Callable[[str], Fraction]:
    """The same function, but only for values above zero."""

    def checked(text: str) -> Fraction:
        value = parse(text)
        if value <= 0:
            raise UnitError(f"'{text.strip()}' is not above zero")
        return value

    return checked


def waiting_time(text: str) -> Fraction:
    """A time that is not in the past."""
    seconds: Fraction = units.parse_time(text)
    if seconds < 0:
        raise UnitError(f"'{text.strip()}' is in the past: write a time such as 20ms")
    return seconds


def speed_or_zero(text: str) -> Fraction:
    """A speed in mm/s that is not below zero."""
    speed: Fraction = units.parse_speed(text)
    if speed < 0:
        raise UnitError(f"'{text.strip()}' is below zero: write a speed such as 2mm/s")
    return speed


def home_method(text: str) -> str:
    """The name or the number of a homing method."""
    if text not in HOME_METHODS and not re.fullmatch(r"[0-9]+", text):
        raise OutOfRange(
            f"'{text}' is no method: allowed are a number of CiA 402, {', '.join(HOME_METHODS)}"
        )
    return text


def axis_of_a_node(text: str) -> tuple[int | None, int]:
    """Address and axis from "2.0"; the address is None in "0"."""
    address, dot, axis = text.rpartition(".")
    return (ADDRESS.parse(address) if dot else None), AXIS.parse(axis)


TEXT = Value("text", str)
FILE = File("file", str)
NUMBER = Value("number", number)
WHOLE = Value("whole number", whole(-(2**31), None, "is no whole number"))
POSITIVE = Value("whole number", whole(1, None, "is no whole number above 0"))
ADDRESS = Value(
    "address",
    whole(
        ADDRESSES[0], ADDRESSES[-1], f"is no address: allowed are {ADDRESSES[0]} to {ADDRESSES[-1]}"
    ),
)
AXIS = Value("axis", whole(0, 255, "is no axis: the first is 0"))
AXIS_OF_A_NODE = Value("axis", axis_of_a_node)
LENGTH = Value("length", units.parse_length)
DISTANCE = Value("length", above_zero(units.parse_length))
ANGLE = Value("angle", units.parse_angle)
SPEED = Value("speed", speed_or_zero)
TIME = Value("time", units.parse_time)
DURATION = Value("time", above_zero(units.parse_time))
WAITING_TIME = Value("time", waiting_time)
FREQUENCY = Value("frequency", above_zero(units.FREQUENCY.parse))
SHARE = Value("share", units.parse_share)
SHARE_ABOVE_ZERO = Value("share", above_zero(units.parse_share))
HOME_METHOD = Value("method", home_method)

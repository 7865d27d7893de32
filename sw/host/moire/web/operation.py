# SPDX-License-Identifier: Apache-2.0
"""What an operation of the server is, what a request of a client brings, and how its fields are
read.
"""

import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

from moire import units
from moire.bus.arbiter import Place
from moire.client.axis import Axis
from moire.web.bridge import Bridge, Client
from moire.web.refusals import BadRequest

Values = dict[str, Any]
WHOLE, LARGEST = re.compile(r"-?[0-9]{1,9}"), 10**9
FRESH_S = 0.01  # of the bus: how old the reply to a poll may be, unless a client says otherwise


@dataclass(frozen=True)
class Call:
    """One request: who asks, for which axis, and what."""

    bridge: Bridge
    client: Client
    node: int = 0
    axis: int = 0
    name: str = ""  # of a parameter
    given: Mapping[str, Any] = field(default_factory=dict)  # the fields of the body or the query
    may_change: bool = True  # its token does not only read

    @property
    def place(self) -> Place:
        """The axis."""
        return self.node, self.axis

    async def command(self, work: Callable[[Axis], Any], pool: str = "short") -> Any:
        """Calls the host package's client code for the axis, for this client."""
        return await self.bridge.command(self.client, self.place, work, pool)

    def oldest(self) -> float:
        """The time of the bus before which a reply to a poll is too old."""
        age = self.given.get("max_age")
        return self.bridge.gateway.time - (FRESH_S if age is None else float(age))


@dataclass(frozen=True)
class Given:
    """A field of a request. `kind` is "text", "flag", "whole number", "value" (a text, or a plain
    number), or "length" or "time", which are texts with a unit.
    """

    name: str
    kind: str
    what: str
    example: Any
    required: bool = False


@dataclass(frozen=True)
class Operation:
    """One thing to ask for. `answer` has the fields of the answer: type and meaning."""

    method: str
    path: str
    what: str
    act: Callable[[Call], Awaitable[Values]]
    answer: Mapping[str, tuple[str, str]]
    given: tuple[Given, ...] = ()
    urgent: bool = False  # not counted by the limits

    @property
    def changes(self) -> bool:
        """Whether a token that only reads may not ask for it."""
        return self.method != "GET"

    @property
    def name(self) -> str:
        """A name that no other operation has."""
        return self.act.__name__


def checked(given: tuple[Given, ...], values: Mapping[str, Any]) -> Values:
    """The fields of a request; raises BadRequest, or UnitError."""
    known = {one.name: one for one in given}
    for name in values:
        if name not in known:
            names = ", ".join(known) or "none"
            raise BadRequest(
                "unknown_field", f"there is no field '{name[:40]}'", f"allowed are: {names}"
            )
    for one in given:
        if one.required and values.get(one.name) is None:
            raise BadRequest(
                "missing_field",
                f"the field '{one.name}' is missing: {one.what}",
                f"write it as in {one.example!r}",
            )
    return {name: read(known[name], value) for name, value in values.items() if value is not None}


def read(one: Given, value: Any) -> Any:
    """One field; raises BadRequest, or UnitError."""
    flags = {"true": True, "false": False}
    if one.kind == "flag":
        value = flags.get(value, value) if isinstance(value, str) else value
        if isinstance(value, bool):
            return value
        raise wrong_type(one, "true or false")
    if one.kind == "whole number":
        if isinstance(value, str) and WHOLE.fullmatch(value):
            value = int(value)
        if isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST:
            return value
        raise wrong_type(one, "a whole number")
    if one.kind == "value" and isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value)  # a plain number, which only a parameter without a unit takes
    if not isinstance(value, str):
        raise wrong_type(one, "a text" + (" with a unit" if one.kind != "text" else ""))
    if one.kind == "length":
        units.parse_length(value)  # the text itself goes on, for it is exact
    if one.kind == "time":
        seconds = units.parse_time(value)
        if seconds < 0:
            raise BadRequest("out_of_range", f"{one.name} is below zero", "give a time from 0s on")
        return seconds
    return value


def wrong_type(one: Given, needed: str) -> BadRequest:
    """The field has another type."""
    return BadRequest(
        "wrong_type", f"the field '{one.name}' is no {one.kind}", f"write {needed}: {one.example!r}"
    )


def whole_number(text: str, what: str) -> int:
    """A part of a path; raises BadRequest."""
    if not text.isascii() or not text.isdigit() or len(text) > 3:
        raise BadRequest(
            "no_such_path",
            f"'{text[:20]}' is no number of {what}",
            "write a path such as /api/nodes/1/axes/0",
            HTTPStatus.NOT_FOUND,
        )
    return int(text)

# SPDX-License-Identifier: Apache-2.0
"""Commands that are made from the tables of the protocol: list, get and set of a table of named
values, and a command for each action.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

import click

from moire.cli.parser import Command, Group
from moire.cli.session import Call
from moire.cli.values import TEXT, Name
from moire.client.values import ParameterValue


class NamedValues(Protocol):
    """The parameters of an axis, or the settings of a station."""

    def get(self, name: str) -> ParameterValue:
        """Reads one."""

    def set(self, name: str, value: str) -> ParameterValue:
        """Sets one, and returns the new value."""


def add_value_commands(
    group: Group,
    what: str,
    known: Sequence[str],
    values_of: Callable[[Call], NamedValues],
    say: Callable[[Call, Mapping[str, Any], str], None],
    *,
    examples: tuple[str, str, str],
    value_help: str,
) -> None:
    """Adds list, get and set. `what` is one value in words; the examples are of these three."""
    listed = f"{group.name} list"
    for_list, for_get, for_set = examples
    name = Name(what, known, listed)
    name_help = f"A name that 'moire {listed}' shows."

    def show(call: Call, values: Iterable[ParameterValue]) -> None:
        found = list(values)
        rows = [
            f"{value.name:<20}{value.written(6):<15}{value.range_words:<33}{value.text}"
            for value in found
        ]
        say(call, {f"{what}s": [value.values() for value in found]}, "\n".join(rows))

    def show_all(call: Call) -> None:
        show(call, map(values_of(call).get, known))

    def get(call: Call, names: tuple[str, ...]) -> None:
        show(call, map(values_of(call).get, names))

    def put(call: Call, name: str, value: str) -> None:
        show(call, [values_of(call).set(name, value)])

    group.command(
        "list",
        help=f"Show all {what}s with their values, units and ranges.",
        example=for_list,
    )(show_all)
    names = click.argument(
        "names", nargs=-1, required=True, type=name, metavar="NAME", help=name_help
    )
    group.command("get", help=f"Show one or several {what}s.", example=for_get)(names(get))
    one_name = click.argument("name", type=name, metavar="NAME", help=name_help)
    value = click.argument("value", type=TEXT, metavar="VALUE", help=value_help)
    group.command("set", help=f"Set one {what}.", example=for_set)(one_name(value(put)))


def add_action_commands(
    group: Group,
    table: Mapping[int, tuple[str, str]],
    names: Iterable[str],
    act: Callable[..., None],
) -> None:
    """Adds a command for each of these actions of a table {code: (name, words)}.

    `act` takes the call and the name of the `action`.
    """
    words_of = dict(table.values())
    for name in names:
        words = words_of[name]
        group.add_command(
            Command(
                name,
                help=f"{words[:1].upper()}{words[1:]}.",
                example=f"moire --port /dev/ttyUSB0 {group.name} {name}",
                callback=partial(act, action=name),
            )
        )

# SPDX-License-Identifier: Apache-2.0
"""Names and descriptions of the codes and bits that a node sends.

Every table is one of moire.made.bus_tables: a code or a bit number, its name, its description.
"""

from collections.abc import Iterable, Mapping

from moire.errors import Refused
from moire.made.bus_tables import CAUSES

Table = Mapping[int, tuple[str, str]]

CAUSE_CODES = {name: code for code, (name, _) in CAUSES.items()}


def bit_names(table: Table, value: int) -> tuple[str, ...]:
    """The names of the bits that are set in `value`; a bit without a name is called "bit 7"."""
    return tuple(
        table[bit][0] if bit in table else f"bit {bit}"
        for bit in range(value.bit_length())
        if value >> bit & 1
    )


def code_name(table: Table, code: int, kind: str) -> str:
    """The name of a code; a code without a name is called "cause 99", with `kind` before it."""
    return table[code][0] if code in table else f"{kind} {code}"


def descriptions(table: Table, names: Iterable[str]) -> str:
    """The descriptions that belong to these names, separated by commas."""
    known = dict(table.values())
    return ", ".join(known.get(name, name) for name in names)


def refusal(address: int, operation: str, code: int) -> Refused:
    """The error for an operation that a node refuses with the cause of this code."""
    cause = code_name(CAUSES, code, "cause")
    words = descriptions(CAUSES, [cause])
    return Refused(cause, code, f"node {address} refused '{operation}': {words}")

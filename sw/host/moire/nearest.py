# SPDX-License-Identifier: Apache-2.0
"""The sentence about a name that does not exist: with those that look like it, or all of a few."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

MOST_NAMES = 12  # a longer list of names is not printed in an error


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
    """The sentence about a name that does not exist. `listed_by` is what lists all."""
    names = tuple(known)
    more = did_you_mean(near_names(name, names))
    if not more and len(names) <= MOST_NAMES:
        more = f": allowed are {', '.join(names)}"
    return f"there is no {what} '{name[:40]}'" + (more or f": {listed_by} lists all")

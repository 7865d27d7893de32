# SPDX-License-Identifier: Apache-2.0
"""Reads the tables of a board or machine file, and refuses what is missing, unknown or of another
type in one line that names the file and the key.
"""

import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

ROOT = Path(__file__).resolve().parents[2]
Value = TypeVar("Value")
NAMES = {str: "a text", int: "a whole number", float: "a number", list: "a list", dict: "a table"}


class Misfit(Exception):
    """One line that says which file is wrong, where, and why."""


class TooLarge(Misfit):
    """A machine that the part of a board cannot hold."""


def shown(path: Path) -> str:
    """The path of a file as messages name it: from the root of the project, if it is inside."""
    return os.path.relpath(path, ROOT) if path.resolve().is_relative_to(ROOT) else str(path)


class Table:
    """A table of a TOML file that knows where it is; each key may be taken once."""

    def __init__(self, content: dict[str, Any], file: str, where: str = "") -> None:
        self.left, self.file, self.where = dict(content), file, where

    def misfit(self, words: str) -> Misfit:
        return Misfit(f"{self.file}: {self.where and f'[{self.where}] '}{words}")

    def take(self, key: str, kind: type[Value], default: Value | None = None) -> Value:
        """The value of a key, checked; without a default the key must be there."""
        found = self.left.pop(key, default)
        if found is None:
            raise self.misfit(f"{key} is missing")
        if kind is float and isinstance(found, int) and not isinstance(found, bool):
            found = float(found)
        if not isinstance(found, kind) or isinstance(found, bool) and kind is not bool:
            raise self.misfit(f"{key} must be {NAMES.get(kind, kind.__name__)}")
        return found

    def within(self, key: str, least: int, most: int, default: int | None = None) -> int:
        """A whole number of a range."""
        found = self.take(key, int, default)
        if not least <= found <= most:
            raise self.misfit(f"{key} = {found} must be {least} to {most}")
        return found

    def words(self, key: str) -> list[str]:
        """A list of texts; empty if the key is not there."""
        found: list[Any] = self.take(key, list, [])
        if wrong := [each for each in found if not isinstance(each, str)]:
            raise self.misfit(f"{key} must contain texts only, not {wrong[0]!r}")
        return found

    def chosen(self, key: str, allowed: Iterable[str]) -> list[str]:
        """A list of texts from a set of known ones."""
        found, known = self.words(key), list(allowed)
        for each in found:
            if each not in known:
                raise self.misfit(f"{key}: {each!r} is none of {', '.join(known)}")
        return found

    def table(self, key: str, needed: bool = False) -> "Table":
        """A table inside; an empty one if it is not there."""
        inside: dict[str, Any] = self.take(key, dict, None if needed else {})
        return Table(inside, self.file, f"{self.where}.{key}".lstrip("."))

    def rows(self, key: str) -> list["Table"]:
        """The tables of an array of tables."""
        found: list[Any] = self.take(key, list, [])
        if any(not isinstance(each, dict) for each in found):
            raise self.misfit(f"{key} must consist of tables: [[{key}]]")
        return [Table(each, self.file, f"{key} {n}") for n, each in enumerate(found, 1)]

    def close(self) -> None:
        """Refuses what nobody has taken: a key that is written wrong would else be ignored."""
        for key in self.left:
            raise self.misfit(f"there is no key {key}")


def read(path: Path) -> Table:
    """The whole of a TOML file."""
    try:
        return Table(tomllib.loads(path.read_text(encoding="utf-8")), shown(path))
    except OSError as why:
        raise Misfit(f"{shown(path)}: {(why.strerror or str(why)).lower()}") from None
    except UnicodeDecodeError:
        raise Misfit(f"{shown(path)}: is no text in UTF-8") from None
    except tomllib.TOMLDecodeError as why:
        raise Misfit(f"{shown(path)}: {why}") from None

# SPDX-License-Identifier: Apache-2.0
"""Tables of numbers that people write, as CSV files.

Each line is a row, `#` begins a comment, and the first row may be a heading.
"""

import csv
import math
from pathlib import Path

from moire.errors import BadFile


def number(text: str, what: str, where: str) -> float:
    """A finite number; raises BadFile with what it should be, and where it is written."""
    try:
        value = float(text)
    except ValueError:
        raise BadFile(f"{where}: {what} is no number: {text.strip()!r}") from None
    if not math.isfinite(value):
        raise BadFile(f"{where}: {what} is {text.strip()}")
    return value


def rows(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The cells of the heading, and the other rows as [(line number, cells)]; raises BadFile.

    Without a heading the first list is empty. Empty rows and comments are left out.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadFile(
            f"{path} cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    found = [
        (line, cells)
        for line, cells in enumerate(lines, start=1)
        if any(cell.strip() for cell in cells) and not cells[0].startswith("#")
    ]
    heading = found.pop(0)[1] if found and found[0][1][0].strip()[:1].isalpha() else []
    return heading, found

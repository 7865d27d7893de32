# SPDX-License-Identifier: Apache-2.0
"""Tables of numbers that people write: CSV, one row a line, `#` begins a comment, a heading may
stand above.
"""

import csv
import math
from pathlib import Path

from moire.errors import BadFile


def number(text: str, what: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise BadFile(f"{where}: {what} is no number: {text.strip()!r}") from None
    if not math.isfinite(value):
        raise BadFile(f"{where}: {what} is {text.strip()}")
    return value


def rows(path: Path) -> tuple:
    """The cells of the heading, none if there is no heading, and [(line, cells)] of what is neither
    that, nor empty, nor a comment.
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

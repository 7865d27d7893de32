# SPDX-License-Identifier: Apache-2.0
"""What the tests reach of a source file, and what no test can reach, with the reason beside it.

A comment `unreachable: REASON` explains what no test reaches in its line: the line itself and the
arms of branches that begin in it, with the lines that belong to such an arm. It excludes nothing
that is reached; where all of its line is reached it is stale, which is an error.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

REASON = re.compile(r"(?://|#|/\*)\s*unreachable: (.*?)\s*(?:\*/)?$")
KINDS = ("line", "branch", "toggle")


class Arm(NamedTuple):
    """A way that a branch may take, or a change that a bit may make."""

    line: int
    column: int
    what: str
    lines: tuple[int, ...] = ()  # that are executed with it


class Tally(NamedTuple):
    """How many of so many points are reached."""

    reached: int
    total: int

    @property
    def percent(self) -> float:
        """The share that is reached; all of nothing is 100."""
        return 100 * self.reached / self.total if self.total else 100.0


@dataclass
class Reached:
    """The counts of a file: how often each line, arm and change of a bit was reached."""

    lines: dict[int, int] = field(default_factory=dict)
    arms: dict[Arm, int] = field(default_factory=dict)
    toggles: dict[Arm, int] = field(default_factory=dict)
    excluded: dict[int, str] = field(default_factory=dict)  # line: reason
    stale: list[int] = field(default_factory=list)  # lines of reasons that explain nothing

    def add_line(self, line: int, count: int) -> None:
        """Count a line, which another build or another arm may have as well."""
        self.lines[line] = self.lines.get(line, 0) + count

    def exclude(self, text: str) -> None:
        """Take out what has a reason in the text of the file."""
        reasons = {
            number: found[1]
            for number, line in enumerate(text.splitlines(), 1)
            if (found := REASON.search(line))
        }
        for arm in [arm for arm, count in self.arms.items() if not count]:
            if at := next((n for n in (arm.line, *arm.lines) if n in reasons), None):
                del self.arms[arm]
                self.excluded[at] = reasons[at]
                for line in arm.lines:
                    if not self.lines.get(line, 1):
                        del self.lines[line]
        for line in [line for line, count in self.lines.items() if not count]:
            if line in reasons:
                del self.lines[line]
                self.excluded[line] = reasons[line]
        self.stale = sorted(set(reasons) - set(self.excluded))

    def tally(self, kind: str) -> Tally:
        """The points of a kind that are reached."""
        found = {"line": self.lines.values(), "branch": self.arms.values()}
        counts = found.get(kind, self.toggles.values())
        return Tally(sum(count > 0 for count in counts), len(counts))


def total(files: Iterable[Reached], kind: str) -> Tally:
    """The points of a kind in several files."""
    tallies = [file.tally(kind) for file in files]
    return Tally(sum(t.reached for t in tallies), sum(t.total for t in tallies))


def merged(parts: Iterable[Mapping[str, Reached]]) -> dict[str, Reached]:
    """The counts of several runs, added."""
    found: dict[str, Reached] = {}
    for part in parts:
        for name, file in part.items():
            into = found.setdefault(name, Reached())
            for line, count in file.lines.items():
                into.add_line(line, count)
            for arm, count in file.arms.items():
                into.arms[arm] = into.arms.get(arm, 0) + count
    return found

# SPDX-License-Identifier: Apache-2.0
"""The page of what the tests reach, docs/coverage.md."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path

from code_coverage.reached import KINDS, Reached, Tally, total

Files = Mapping[str, Reached]
LONGEST_TEXT = 70  # characters of a line of source that the page shows
WORDS = {  # of an arm that no test reaches
    "if": "never true",
    "elsif": "never true",
    "else": "never false",
    "case": "never chosen",
    "cond_then": "never true",
    "cond_else": "never false",
}
HEAD = """\
<!-- SPDX-License-Identifier: Apache-2.0 -->
<!-- Made by `make coverage`: do not edit. -->
# Coverage

What the tests execute of the RTL, of the firmware and of the host package, and what they do not.
`make coverage` measures it again and writes this page; tests whose sources have not changed are not
run again.

- **RTL**: the tests of the blocks run under Verilator with `--coverage-line` and
  `--coverage-toggle`. The counts of a place are added over all tests, parameters and instances. A
  branch is an arm of an `if`, of a `case` or of a conditional operator. A toggle is the change of a
  bit from 0 to 1 or from 1 to 0. Verilator does not count continuous assignments as lines.
  Properties (`FORMAL`) are proved and not simulated, so they do not count; neither do benches, nor
  the soft cores of others.
- **Firmware**: compiled for this computer by gcc without optimisation, and measured by gcov with
  the tests of `tb/firmware` and `tb/host`. A branch is a way out of a condition; each part of
  `a && b` is a condition. What the firmware does on the soft core does not count.
- **Host**: the package `moire`, measured by coverage.py with the same tests.

A place that no input can reach has the comment `unreachable: reason` in its line. It does not
count, and is listed below with its reason. A reason in a line of which everything is reached is an
error.
"""
Hole = tuple[int, str]


def cells(tallies: Iterable[Tally]) -> str:
    """The percentages and the numbers of points, as cells of a row."""
    return " | ".join(f"{t.percent:.1f} % of {t.total:,}" if t.total else "–" for t in tallies)


def rows(files: Files, depth: int, kinds: Sequence[str]) -> list[str]:
    """A row for each directory of files."""

    def directory(name: str) -> str:
        return "/".join(Path(name).parent.parts[:depth])

    found = []
    for where, names in groupby(sorted(files, key=lambda n: (directory(n), n)), directory):
        group = [files[name] for name in names]
        shares = cells(total(group, kind) for kind in kinds)
        found.append(f"| `{where}` | {len(group)} | {shares} |")
    return found


def table(title: str, files: Files, depth: int, kinds: Sequence[str]) -> list[str]:
    """The table of a part, directory by directory."""
    names = {"line": "lines", "branch": "branches", "toggle": "toggles"}
    head = " | ".join(names[kind] for kind in kinds)
    whole = cells(total(files.values(), kind) for kind in kinds)
    return [
        f"| {title} | files | {head} |",
        "| --- | --- |" + " --- |" * len(kinds),
        *rows(files, depth, kinds),
        f"| all | {len(files)} | {whole} |",
        "",
    ]


def spans(numbers: Iterable[int]) -> list[tuple[int, int]]:
    """Numbers as ranges, (first, last)."""
    found: list[tuple[int, int]] = []
    for n in sorted(numbers):
        if found and n == found[-1][1] + 1:
            found[-1] = found[-1][0], n
        else:
            found.append((n, n))
    return found


def holes(one: Reached) -> list[Hole]:
    """(line, what no test reaches) of a file: arms of branches that are executed, and lines."""
    found: list[Hole] = []
    inside: set[int] = set()  # lines that belong to an arm that is named
    ways: dict[int, list[str]] = defaultdict(list)
    for arm, count in sorted(one.arms.items()):
        if not count and one.lines.get(arm.line, 1):
            ways[arm.line].append(WORDS.get(arm.what, f"never {arm.what}"))
            inside.update(arm.lines)
    found += [(line, ", ".join(dict.fromkeys(words))) for line, words in ways.items()]
    missed = [line for line, count in one.lines.items() if not count and line not in inside]
    for first, last in spans(missed):
        found.append((first, "not executed" if first == last else f"to {last} not executed"))
    return sorted(found)


def shown(text: str) -> str:
    """A line of source, short enough for the page."""
    words = " ".join(text.split()).replace("`", "'")
    return words if len(words) <= LONGEST_TEXT else words[: LONGEST_TEXT - 2] + " …"


def named(files: Files, texts: Mapping[str, Sequence[str]]) -> list[str]:
    """The holes of all files, as a list."""
    found = []
    for name, one in sorted(files.items()):
        if of_file := holes(one):
            found.append(f"- `{name}`")
            for line, words in of_file:
                found.append(f"  - {line} {words}: `{shown(texts[name][line - 1])}`")
    return found or ["None."]


def bits(ranges: Iterable[tuple[int, int]]) -> str:
    """`[3:0], [7]`"""
    return ", ".join(f"[{a}]" if a == b else f"[{b}:{a}]" for a, b in ranges)


def still(one: Reached) -> str:
    """The signals of a file with bits that miss a change."""
    signals: dict[str, set[int]] = defaultdict(set)
    for arm, count in sorted(one.toggles.items()):
        if not count:
            whole = arm.what.rpartition(":")[0]
            name, bit = re.fullmatch(r"(.*?)(?:\[(\d+)\])?", whole).groups()  # type: ignore[union-attr]
            signals[name].update([int(bit)] if bit else [])
    return ", ".join(f"`{name}{bits(spans(n))}`" for name, n in signals.items())


def reasons(parts: Iterable[Files]) -> list[str]:
    """What does not count, with its reason."""
    found = [
        f"| `{name}:{line}` | {reason} |"
        for files in parts
        for name, one in sorted(files.items())
        for line, reason in sorted(one.excluded.items())
    ]
    return ["| place | reason |", "| --- | --- |", *found] if found else ["None."]


def unmeasured(left: Sequence[str]) -> list[str]:
    """The warning of a page that was made before all tests had been run."""
    if not left:
        return []
    return [
        f"**Not complete.** There was no time for {len(left)} files of tests of blocks, so blocks",
        "are missing, and others are reached more than it says here:",
        f"{', '.join(f'`{name}`' for name in left)}.\n",
    ]


def page(
    rtl: Files,
    firmware: Files,
    host: Files,
    absent: Sequence[str],
    left: Sequence[str],
    measured: str,
    root: Path,
) -> str:
    """The whole page; `absent` are sources of which no test executes anything, `left` tests that
    were not run, and `measured` says when and of which version.
    """
    parts = (rtl, firmware, host)
    texts = {name: (root / name).read_text().splitlines() for part in parts for name in part}
    quiet = [
        f"- `{name}`, {sum(not n for n in one.toggles.values())} of {len(one.toggles)}: {found}"
        for name, one in sorted(rtl.items())
        if (found := still(one))
    ]
    return "\n".join(
        [
            HEAD,
            f"{measured}\n",
            *unmeasured(left),
            *table("RTL", rtl, 2, KINDS),
            *table("firmware", firmware, 3, KINDS[:2]),
            *table("host", host, 4, KINDS[:2]),
            "## Not executed at all\n",
            *([f"- `{name}`" for name in absent] or ["None."]),
            "\n## Holes of the RTL\n",
            *named(rtl, texts),
            "\n## Holes of the firmware\n",
            *named(firmware, texts),
            "\n## Holes of the host package\n",
            *named(host, texts),
            "\n## Cannot be reached\n",
            *reasons(parts),
            "\n## Bits of the RTL that miss a change\n",
            *(quiet or ["None."]),
            "",
        ]
    )

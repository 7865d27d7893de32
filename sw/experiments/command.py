# SPDX-License-Identifier: Apache-2.0
"""The command line of an experiment: what all of them have, and how each of them ends."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from experiments import start_page
from moire.errors import MoireError
from twin import BuildError

MOST = 10_000  # moves, searches or places of one run
INTERRUPTED = 130  # exit code after Ctrl-C, as of any program

Result = TypeVar("Result")


def parser_of(experiment: str, description: str, seed: str = "") -> argparse.ArgumentParser:
    """A parser with --seed and --report. `seed` is what the seed is of besides the machine."""
    parser = argparse.ArgumentParser(
        prog=f"python -m experiments.{experiment}", description=description
    )
    of = f"the machine and of {seed}" if seed else "the machine"
    parser.add_argument("--seed", type=int, default=1, help=f"seed of {of} (default 1)")
    parser.add_argument(
        "--report",
        type=Path,
        default=start_page.FOLDER,
        help="directory of the page (default build/report)",
    )
    return parser


def add_number(
    parser: argparse.ArgumentParser,
    option: str,
    what: str,
    default: int,
    least: int = 1,
    most: int = MOST,
) -> None:
    """An option with a number from `least` to `most`; another one is refused."""

    def number(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"takes {least} to {most}, not {text}")
        return int(text)

    words = f"number of {what}, {least} to {most} (default {default})"
    parser.add_argument(option, type=number, default=default, metavar="N", help=words)


def exit_code(
    experiment: str, run: Callable[[], Result], failed: Callable[[Result], bool] = lambda _: False
) -> int:
    """Runs an experiment: 1 if its result has failed; an error is one line on the terminal, with
    the exit code of its kind.
    """
    try:
        return int(failed(run()))
    except (MoireError, BuildError) as error:
        print(f"{experiment}: {error}", file=sys.stderr)
        return int(getattr(error, "exit_code", 1))
    except KeyboardInterrupt:
        print(f"{experiment}: interrupted", file=sys.stderr)
        return INTERRUPTED

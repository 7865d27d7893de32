# SPDX-License-Identifier: Apache-2.0
"""Which faults inside a module of the host no test of the module sees.

    python -m mutation.host [MODULE …]      mutants of these modules, or of all; see --help

Cosmic Ray (`make mutators`) makes the mutants: one operator, comparison, number or the like of
the source is another one. mutation.forked_tests runs the tests of host.toml on each of them. What
no test sees is a survivor. It needs a better test, or a reason in host.toml. Nothing proves that a
mutant is equivalent to the module.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mutation import command
from mutation.sources import MUTANTS, Language, entry_of
from twin.build import ROOT


def path_of(module: str) -> Path:
    """The source of a module."""
    return ROOT / "sw" / "host" / (module.replace(".", "/") + ".py")


PYTHON = Language(
    "host", Path(__file__).with_name("host.toml"), "cosmic_ray", "mutation.host_texts", path_of
)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m mutation.host")
    parser.add_argument(
        "names", nargs="*", metavar="MODULE", help="modules of host.toml; default: all"
    )
    unknown = "has no tests in sw/mutation/host.toml"
    known, measure = PYTHON.tests(), PYTHON.measured
    return command.run(parser, arguments, known, unknown, MUTANTS, measure, entry_of)


if __name__ == "__main__":
    sys.exit(main())

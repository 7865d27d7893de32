# SPDX-License-Identifier: Apache-2.0
"""Which faults inside a module of the host no test of the module sees.

    python -m mutation.host [MODULE …]      mutants of these modules, or of all; see --help

Cosmic Ray (`make mutators`) makes the mutants: one operator, comparison, number or the like of
the source is another one. mutation.forked_tests runs the tests of host.toml on each of them. What
no test sees is a survivor. It needs a better test, or a reason in host.toml. Nothing proves that a
mutant is equivalent to the module.
"""

import sys
from pathlib import Path

from mutation.sources import Language
from twin.build import ROOT


def path_of(module: str) -> Path:
    """The source of a module."""
    return ROOT / "sw" / "host" / (module.replace(".", "/") + ".py")


PYTHON = Language(
    "host", Path(__file__).with_name("host.toml"), "cosmic_ray", "mutation.host_texts", path_of
)


if __name__ == "__main__":
    sys.exit(PYTHON.main())

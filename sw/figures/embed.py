# SPDX-License-Identifier: Apache-2.0
"""Figure of the use by others: FuseSoC cores, a LiteX SoC and the examples of docs/embedding.md."""

from collections.abc import Sequence

from embed import check, fusesoc
from figures.common import Figure, Quick, console


def embed_failed(
    cores: Sequence[str] = (), examples: Sequence[str] = (), whole: bool = True, seed: int = 1
) -> float:
    """Failures of lint, build and simulation of these cores, or of all, and of the examples, of
    which these are built, or all; `whole` simulates them and builds the LiteX SoC as well.
    """
    found = fusesoc.wrong(fusesoc.named(cores), seed)
    for name, example in check.EXAMPLES.items():
        found += check.wrong_example(example, not examples or name in examples, whole)
    if whole:
        found += check.wrong_soc()
    for line in found:
        console.print(line, markup=False, highlight=False)
    return float(len(found))


FIGURES = {
    "embed_failed": Figure(
        embed_failed,
        "failures",
        "FuseSoC cores of all modules (lint and, where a module has tests of its own, simulation), "
        "the LiteX SoC with an axis and a node, the three examples of docs/embedding.md: steps of "
        "lint, build and simulation that fail",
        "0",
        Quick(
            {"cores": ("synchroniser",), "examples": ("position_counter",), "whole": False},
            "one core, lint of the examples, build of one",
        ),
        0,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figure of the use by others: FuseSoC cores, a LiteX SoC and the examples of docs/embedding.md."""

from collections.abc import Sequence

from embed import check, fusesoc
from figures.common import Figure, Quick, console


def embed_failed(
    cores: Sequence[str] = (), examples: Sequence[str] = (), whole: bool = True, seed: int = 1
) -> float:
    """Failures of lint, build and simulation: of these cores and examples, or of all if none is
    named; `whole` simulates the examples and builds the LiteX SoC as well.
    """
    found = fusesoc.wrong(fusesoc.named(cores), seed)
    for name in examples or check.EXAMPLES:
        found += check.wrong_example(check.EXAMPLES[name], whole)
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
            "one core, lint and build of one example",
        ),
        0,
    ),
}

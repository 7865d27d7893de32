# SPDX-License-Identifier: Apache-2.0
"""Prints texts of mutants of a Python source, as a list in JSON, for mutation.host.

PYTHONPATH=build/mutators python -m mutation.host_texts FILE COUNT SEED
"""

import ast
import json
import random
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

from mutation.sources import drawn

Place = tuple[int, int]  # line, column


def annotations(source: str) -> Iterator[tuple[Place, Place]]:
    """Where the types of a source stand, from … to: they do nothing."""
    for node in ast.walk(ast.parse(source)):
        for name in ("annotation", "returns"):
            kind = getattr(node, name, None)
            if isinstance(kind, ast.expr):
                assert kind.end_lineno is not None and kind.end_col_offset is not None
                yield (kind.lineno, kind.col_offset), (kind.end_lineno, kind.end_col_offset)


def faults(source: str) -> dict[Place, list[tuple[str, int]]]:
    """{place: (operator of Cosmic Ray, number of its occurrence) of each fault there}"""
    tree, types = get_ast(source), list(annotations(source))
    found: dict[Place, list[tuple[str, int]]] = defaultdict(list)
    for name in sorted(operator_names()):
        operator = get_operator(name)
        if operator.arguments():
            continue
        begins = [
            begin for node in ast_nodes(tree) for begin, _ in operator().mutation_positions(node)
        ]
        for occurrence, begin in enumerate(begins):
            if not any(low <= begin < high for low, high in types):
                found[begin].append((name, occurrence))
    return found


def texts(source: str, count: int, draw: random.Random) -> list[str]:
    """So many texts with one fault each: first one at each place, then further ones."""
    found: dict[str, None] = {}
    for name, occurrence in drawn(faults(source), draw):
        if len(found) == count:
            break
        text = mutate_code(source, get_operator(name)(), occurrence)
        if text is not None and text != source:
            found[text] = None
    return list(found)


def main(file: Path, count: int, seed: int) -> None:
    draw = random.Random(f"{file.name} {seed}")
    print(json.dumps(texts(file.read_text(), count, draw)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))

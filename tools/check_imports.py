# SPDX-License-Identifier: Apache-2.0
"""Cycles among modules, and imports that go round the package system.

- Python: the modules of moire, twin, boards, campaigns, code_coverage, embed, experiments, figures,
  fuzz, firmware, linuxcnc_config, mutation, study, tables, tools and tb import each other without a
  cycle, deferred imports included;
- nothing outside tb imports from tb, and moire imports none of the others;
- nothing patches sys.path or loads a file by an import spec;
- C and C++: a module is x.c with x.h; modules include each other without a cycle;
- firmware: a module includes only modules of its own and of lower layers, and the directories of
  the station include each other without a cycle.

    python -m tools.check_imports        lists what breaks a rule; exit code 1 when there is any
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from tools import ROOT, exit_code

PACKAGES = {
    "moire": "sw/host/moire",
    "twin": "sw/twin",
    "boards": "sw/boards",
    "campaigns": "sw/campaigns",
    "code_coverage": "sw/code_coverage",
    "embed": "sw/embed",
    "experiments": "sw/experiments",
    "figures": "sw/figures",
    "firmware": "sw/firmware",
    "fuzz": "sw/fuzz",
    "linuxcnc_config": "sw/linuxcnc_config",
    "mutation": "sw/mutation",
    "study": "sw/study",
    "tables": "tables",
    "tools": "tools",
    "tb": "tb",
}
C_ROOTS = ("sw/firmware", "sw/linuxcnc", "sw/twin")
FIRMWARE = "sw/firmware/"
LAYERS = ("made", "core", "planner", "axis", "bus", "calibration", "station", "update", "images")
BESIDE = {"calibration", "station"}  # neither includes the other
HIDDEN = re.compile(r"\bsys\.path(\[|\.| *\+?=)|\bspec_from_file_location\b")

Graph = dict[str, set[str]]


def files(*patterns: str) -> list[Path]:
    """The files that git knows, by pattern."""
    listed = subprocess.run(
        ["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def module_name(path: Path) -> str | None:
    """Dotted name of a Python file, None where it is in no package."""
    for package, folder in PACKAGES.items():
        if path.is_relative_to(ROOT / folder):
            parts = [package, *path.relative_to(ROOT / folder).with_suffix("").parts]
            return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    return None


def executed(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a module without what is there for the type checker only."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        yield node
        yield from executed(node)


def imports_of(tree: ast.Module, name: str, is_package: bool) -> set[str]:
    """Dotted names that a module imports; `from a import b` gives both a.b and a."""
    found: set[str] = set()
    for node in executed(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = name.split(".")
            base = parts[: len(parts) - node.level + is_package] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{source}.{alias.name}" for alias in node.names} | {source}
    return found


def python_graph() -> Graph:
    """{module: modules it imports}. A package whose modules are named needs not be loaded first:
    it counts only where a name of its own is taken from it."""
    trees: dict[str, tuple[ast.Module, bool]] = {}
    for path in files("*.py"):
        name = module_name(path)
        if name:
            tree = ast.parse(path.read_text(encoding="utf-8"))
            trees[name] = (tree, path.name == "__init__.py")
    graph: Graph = {}
    for name, (tree, is_package) in trees.items():
        wanted = imports_of(tree, name, is_package) & trees.keys()
        for package in [n for n in wanted if any(m.startswith(f"{n}.") for m in wanted)]:
            taken = {
                alias.name
                for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom) and node.module == package
                for alias in node.names
            }
            if all(f"{package}.{one}" in trees for one in taken):
                wanted.discard(package)
        graph[name] = wanted - {name}
    return graph


def c_graph() -> Graph:
    """{module: modules it includes}, a module being a header with its source."""
    graph: Graph = {}
    for root in C_ROOTS:
        for path in files(f"{root}/*.c", f"{root}/*.h", f"{root}/*.cpp"):
            name = str(path.relative_to(ROOT).with_suffix(""))
            included = re.findall(r'^#include "([^"]+)"', path.read_text(encoding="utf-8"), re.M)
            inside = {
                str(Path(root, i).with_suffix("")) for i in included if (ROOT / root / i).exists()
            }
            graph.setdefault(name, set()).update(inside - {name})
    return graph


def cycles(graph: Graph) -> list[str]:
    """One row for each cycle; the last edge of a cycle that was found is left out of the rest."""
    left, found = {name: set(others) for name, others in graph.items()}, []
    while True:
        try:
            TopologicalSorter(left).prepare()
        except CycleError as error:
            ring = error.args[1]  # each is imported by the next
            found.append("cycle: " + " <- ".join(ring))
            left[ring[1]].discard(ring[0])
        else:
            return found


def wrong_layers(graph: Graph) -> list[str]:
    """Includes of the firmware that lead to a higher layer, and cycles of the directories of the
    station; graph: see c_graph.
    """
    found: list[str] = []
    directories: Graph = {}
    firmware = {
        name.removeprefix(FIRMWARE): {other.removeprefix(FIRMWARE) for other in others}
        for name, others in sorted(graph.items())
        if name.startswith(FIRMWARE)
    }
    for name, others in firmware.items():
        layer, directory = name.partition("/")[0], name.rpartition("/")[0]
        for other in sorted(others):
            below = other.partition("/")[0]
            if LAYERS.index(below) > LAYERS.index(layer) or {below, layer} == BESIDE:
                found.append(f"{FIRMWARE}{name} must not include {other}")
        if layer == "station":
            above = {other.rpartition("/")[0] for other in others} - {directory}
            directories.setdefault(directory, set()).update(above)
    return [*found, *cycles(directories)]


def wrong_ways(graph: Graph) -> list[str]:
    """Imports from tb outside tb, and imports of the workshop by the host package."""
    found = []
    for name, others in sorted(graph.items()):
        top = name.partition(".")[0]
        for other in sorted(others):
            below = other.partition(".")[0]
            if (below == "tb" and top != "tb") or (top == "moire" and below != "moire"):
                found.append(f"{name} must not import {other}")
    return found


def hidden_imports() -> list[str]:
    """Lines that patch sys.path or load a file by an import spec."""
    return [
        f"{path.relative_to(ROOT)}:{n}: {line.strip()}"
        for path in files("*.py")
        if path != Path(__file__).resolve()
        for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if HIDDEN.search(line)
    ]


def problems() -> list[str]:
    """Everything that breaks a rule."""
    python, c = python_graph(), c_graph()
    return [
        *cycles(python),
        *wrong_ways(python),
        *hidden_imports(),
        *cycles(c),
        *wrong_layers(c),
    ]


def main() -> int:
    return exit_code(problems())


if __name__ == "__main__":
    sys.exit(main())

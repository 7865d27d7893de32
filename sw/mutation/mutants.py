# SPDX-License-Identifier: Apache-2.0
"""The mutants of port connections, and block diagrams that contain all of them.

A connection is tied to 0, tied to 1, inverted, or swapped with the next connection of the same
direction and width of its instance. All mutants of a build are in one design: each connection
passes through an expression that depends on the variables of the package `wiring_mutant`, which
select one mutant at run time. Without one the design is the original.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mutation.connections import RTL, Connection, leaves, of_diagram, tree

KINDS = ("tied to 0", "tied to 1", "inverted")
SWAPPED = "swapped with"
PACKAGE = """package wiring_mutant;
    int connection /*verilator public_flat_rw*/;
    int kind /*verilator public_flat_rw*/;
    int swap /*verilator public_flat_rw*/;
endpackage
"""


@dataclass(frozen=True)
class Mutant:
    """One fault of the wiring, and the values that select it."""

    connection: Connection
    what: str  # one of KINDS, or with what it is swapped
    selected: tuple[int, int, int]  # connection, kind, swap

    @property
    def name(self) -> str:
        """Its name in lists and in wiring.toml."""
        return f"{self.connection.name} {self.what}"

    @property
    def place(self) -> str:
        """Where it is, as an editor wants it."""
        return f"rtl/{self.connection.file.relative_to(RTL)}:{self.connection.line}"


def pairs(connections: Sequence[Connection]) -> list[tuple[Connection, Connection]]:
    """Neighbours that can be swapped: of the same instance, direction and width. Each connection is
    in one pair with the next one, if there is one.
    """
    groups: dict[tuple[Path, str, bool, str], list[Connection]] = defaultdict(list)
    for c in connections:
        groups[c.file, c.instance, c.output, c.width].append(c)
    return [pair for group in groups.values() for pair in zip(group, group[1:])]


def uses(file: Path) -> Counter[str]:
    """How often each identifier of a diagram is used, but for the names of ports and parameters
    before a parenthesis.
    """
    tokens, found = list(leaves(tree(file))), Counter[str]()
    texts = [str(leaf.get("text", leaf["tag"])) for leaf in tokens]
    for before, text, after in zip(["", *texts], texts, [*texts[1:], ""]):
        if not (before == "." and after == "("):
            found[text] += 1
    return found


def same_faults(connections: Sequence[Connection]) -> dict[Connection, Connection]:
    """Outputs whose only listener is one input: their faults are those of the input. The net has
    three uses then, its declaration and its two ends.
    """
    count = {file: uses(file) for file in {c.file for c in connections}}
    listeners = {(c.file, c.expression): c for c in connections if not c.output}
    return {
        c: listeners[c.file, c.expression]
        for c in connections
        if c.output and (c.file, c.expression) in listeners and count[c.file][c.expression] == 3
    }


def unheard(connections: Sequence[Connection]) -> set[Connection]:
    """Outputs without a listener, which the diagram itself says: their net is used in a wire
    `unused...` only, or its name begins so.
    """
    found = set()
    for file in {c.file for c in connections}:
        count, text = uses(file), file.read_text()
        said = " ".join(re.findall(r"wire unused\w* = &\{(.*?)\};", text, re.DOTALL))
        listed = Counter(re.findall(r"[A-Za-z_]\w*(?!\w|\[)", said))
        for c in connections:
            if c.file == file and c.output:
                alone = listed[c.expression] == 1 and count[c.expression] == 3
                if alone or c.expression.startswith("unused"):
                    found.add(c)
    return found


@dataclass
class Design:
    """The mutants of some connections, by the numbers that select them. `chosen` are those whose
    mutants are in the list; the others are there as neighbours.
    """

    connections: list[Connection]
    chosen: set[Connection]

    def __post_init__(self) -> None:
        everything = pairs(self.connections)
        self.same = same_faults(self.connections)
        self.unheard = unheard(self.connections)
        self.pairs = [pair for pair in everything if self.chosen & set(pair)]
        needed = self.chosen | {c for pair in self.pairs for c in pair}
        self.connections = [c for c in self.connections if c in needed]
        self.number = {c: n for n, c in enumerate(self.connections, 1)}

    @classmethod
    def of(
        cls,
        files: Iterable[Path],
        clocks: bool = False,
        chosen: Callable[[Connection], bool] = lambda c: True,
    ) -> "Design":
        """The mutants of diagrams: of their clocks, or of all but their clocks."""
        found = [c for file in files for c in of_diagram(file)]
        of_kind = [c for c in found if (c.port == "clk") == clocks]
        return cls(of_kind, {c for c in of_kind if chosen(c)})

    def mutants(self) -> list[Mutant]:
        """All mutants, each fault once."""
        found = [
            Mutant(c, what, (n, kind, 0))
            for c, n in self.number.items()
            for kind, what in enumerate(KINDS)
            if c in self.chosen - self.unheard
            and not (c in self.same and self.same[c] in self.chosen)
        ]
        for n, (one, other) in enumerate(self.pairs, 1):
            if one.expression != other.expression and not {one, other} <= self.unheard:
                found.append(Mutant(one, f"{SWAPPED} {other.port}", (0, 0, n)))
        return sorted(found, key=lambda m: self.number[m.connection])

    def expression(self, c: Connection, value: str, values: dict[Connection, str]) -> str:
        """What a connection becomes, with the values of all."""
        text = (
            f"(wiring_mutant::connection == {self.number[c]} ? (wiring_mutant::kind == 0 ? '0 : "
            f"wiring_mutant::kind == 1 ? '1 : ~({value})) : "
        )
        for n, pair in enumerate(self.pairs, 1):
            if c in pair:
                other = pair[1 - pair.index(c)]
                text += f"wiring_mutant::swap == {n} ? ({values[other]}) : "
        return f"{text}({value}))"

    def text(self, file: Path) -> str:
        """A diagram with its mutants."""
        source, edits = file.read_bytes(), []
        own = [c for c in self.connections if c.file == file]
        values = {c: f"wiring_{self.number[c]}" if c.output else c.expression for c in own}
        for c in own:
            if c.output:
                name, (start, end) = values[c], c.around
                edits.append((c.start, c.end, f".{c.port}({name})"))
                edits.append((start, start, f"wire [$bits({c.expression})-1:0] {name};\n"))
                changed = self.expression(c, name, values)
                edits.append((end, end, f"\nassign {c.expression} = {changed};"))
            else:
                edits.append(
                    (c.start, c.end, f".{c.port}({self.expression(c, values[c], values)})")
                )
        for start, end, text in sorted(edits, key=lambda e: (e[0], e[1]), reverse=True):
            source = source[:start] + text.encode() + source[end:]
        return source.decode()

    def write(self, folder: Path) -> list[Path]:
        """The package and the diagrams with their mutants, in the order in which they are read."""
        files = [folder / "wiring_mutant.sv"]
        files[0].write_text(PACKAGE)
        for file in sorted({c.file for c in self.connections}):
            files.append(folder / file.name)
            files[-1].write_text(self.text(file))
        return files

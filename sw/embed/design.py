# SPDX-License-Identifier: Apache-2.0
"""What a module of the RTL is made of, read from its source: parameters, ports, the modules that it
instantiates, and all files that it needs.

The sources are laid out by the formatter of `make lint`, so each parameter and each port has a line
of its own.

    python -m embed.design MODULE        prints the files that a module needs, itself last
"""

import ast
import operator
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from twin.build import CORES, ROOT, package

EXAMPLES = Path(__file__).resolve().parent / "examples"
FORMAL = re.compile(r"^`ifdef FORMAL$.*?^`endif$", re.MULTILINE | re.DOTALL)
INSTANCE = re.compile(r"^\s*(\w+) (?:#\(|u_\w+ \()", re.MULTILINE)
FOREIGN_INSTANCE = re.compile(r"^\s*(\w+)\s*(?:#|\w+\s*\(|$)", re.MULTILINE)
PARAMETER = re.compile(r"\s*parameter +(?:(\w+) +)?(?:\[.*?\] *)?(\w+) *= (.*?),?$")
PORT = re.compile(r"\s*(input|output|inout) +(?:wire|logic) *(?:signed)? *(?:\[(.*?)\])? *(\w+),?$")
LOCAL = re.compile(r"localparam int +(\w+) += (.*?),?$")
STRING = re.compile(r'".*"')


# of Verilator, at the head of what Yosys and LiteX write: their style is not ours
FOREIGN_STYLE = "".join(
    f"// verilator lint_off {rule}\n"
    for rule in (
        *("CASEINCOMPLETE", "COMBDLY", "DECLFILENAME", "PROCASSINIT", "UNUSEDSIGNAL"),
        *("WIDTHEXPAND", "WIDTHTRUNC"),
    )
)


class DesignError(Exception):
    """Something that is asked of a module which it does not have."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a module."""

    name: str
    default: str  # as written; it may depend on other parameters
    meaning: str  # the comment of its line, or the one above it

    @property
    def is_string(self) -> bool:
        return bool(STRING.fullmatch(self.default))


@dataclass(frozen=True)
class Port:
    """A port of a module."""

    name: str
    direction: str  # input, output
    packed: str  # range as written, "" for one bit
    meaning: str  # the comment of its line, or the one above it


@cache
def modules() -> dict[str, Path]:
    """{name: file} of the modules below rtl/ and of the examples."""
    files = [*(ROOT / "rtl").rglob("*.sv"), *EXAMPLES.glob("*.sv")]
    return {path.stem: path for path in sorted(files)}


@cache
def foreign() -> dict[str, Path]:
    """{name: file} of the modules of the soft cores, which come as packages."""
    folders = [package(name, "a soft core") / place for name, place in CORES.items()]
    return {path.stem: path for folder in folders for path in sorted(folder.glob("*.v"))}


def file_of(module: str) -> Path:
    """The file of a module."""
    found = modules().get(module) or foreign().get(module)
    if not found:
        raise DesignError(f"there is no module {module} under rtl/ or among the examples")
    return found


@cache
def source(module: str) -> str:
    """The text of a module without its properties."""
    return FORMAL.sub("", file_of(module).read_text(encoding="utf-8"))


def instances(module: str) -> tuple[str, ...]:
    """Names of the modules that a module instantiates, each once, in the order of the alphabet."""
    known, pattern = {*modules(), *foreign()}, INSTANCE
    if module in foreign():
        known, pattern = {*foreign()}, FOREIGN_INSTANCE
    return tuple(sorted({name for name in pattern.findall(source(module)) if name in known}))


def below(module: str) -> tuple[str, ...]:
    """Names of all modules that a module needs, itself last."""
    found: dict[str, None] = {}

    def add(name: str) -> None:
        for one in instances(name):
            if one not in found and one != name:
                add(one)
        found[name] = None

    add(module)
    return tuple(found)


def files(*tops: str) -> list[Path]:
    """All files that some modules need, each once, a module behind those that it instantiates."""
    return [file_of(name) for name in dict.fromkeys(n for top in tops for n in below(top))]


def head(module: str) -> Iterator[tuple[str, str]]:
    """(code, comment) of each line between `module` and the end of its ports; a comment on lines
    of its own belongs to the next line that has code, unless that line has one too.
    """
    lines = iter(source(module).splitlines())
    above = ""
    for line in lines:
        if re.match(r"module\b", line):
            break
    for line in lines:
        if re.match(r"\s*\);", line):
            return
        code, _, comment = (part.strip() for part in line.partition("//"))
        if code:
            yield code, comment or above
            above = ""
        elif not comment.startswith("verilator"):
            above = f"{above} {comment}".strip()


@cache
def parameters(module: str) -> dict[str, Parameter]:
    """{name: parameter} of a module, in their order."""
    found = {}
    for code, comment in head(module):
        if match := PARAMETER.match(code):
            found[match[2]] = Parameter(match[2], match[3], comment)
    return found


@cache
def ports(module: str) -> dict[str, Port]:
    """{name: port} of a module, in their order."""
    found = {}
    for code, comment in head(module):
        if match := PORT.match(code):
            found[match[3]] = Port(match[3], match[1], match[2] or "", comment)
    if not found:
        raise DesignError(f"no ports were found in {file_of(module)}")
    return found


OPERATORS: dict[type[ast.AST], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.LShift: operator.lshift,
    ast.Eq: operator.eq,
    ast.Gt: operator.gt,
}
CHOICE = re.compile(r"(.+?) \? (.+?) : (.+)")


def number(text: str, values: Mapping[str, int]) -> int:
    """The value of a range or a default: numbers, parameters, + - * / % << == >, $clog2, and one
    choice `a ? b : c`.
    """

    def of(node: ast.expr) -> int:
        match node:
            case ast.Constant(value=int(value)):
                return value
            case ast.Name(id=name) if name in values:
                return values[name]
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return OPERATORS[type(op)](of(left), of(right))
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in OPERATORS:
                return OPERATORS[type(op)](of(left), of(right))
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return of(body) if of(test) else of(orelse)
            case ast.Call(func=ast.Name(id="clog2"), args=[argument]):
                return (of(argument) - 1).bit_length()
        raise DesignError(
            f"the expression `{text}` has a part that is not known: {ast.unparse(node)}"
        )

    python = text.replace("$", "").replace("/", "//").strip()
    return of(ast.parse(CHOICE.sub(r"(\2) if \1 else (\3)", python), mode="eval").body)


def values_of(module: str, chosen: Mapping[str, int | str]) -> dict[str, int]:
    """{name: value} of the parameters of a module that are numbers, where some are chosen; one
    whose default `number` does not know is left out.
    """
    known = parameters(module)
    for name in chosen:
        if name not in known:
            raise DesignError(
                f"{module} has no parameter {name}; it has {', '.join(known) or 'none'}"
            )
    found = {name: value for name, value in chosen.items() if isinstance(value, int)}
    for name, one in known.items():
        if name not in chosen and not one.is_string:
            with suppress(DesignError, SyntaxError):
                found[name] = number(one.default, found)
    for code, _ in head(module):
        if match := LOCAL.match(code):
            with suppress(DesignError, SyntaxError):
                found[match[1]] = number(match[2], found)
    return found


def widths(module: str, chosen: Mapping[str, int | str] | None = None) -> dict[str, int]:
    """{port: bits} of a module with some parameters."""
    values = values_of(module, chosen or {})
    found = {}
    for name, port in ports(module).items():
        most, _, least = port.packed.partition(":")
        found[name] = number(most, values) - number(least, values) + 1 if port.packed else 1
    return found


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        print(*files(sys.argv[1]), sep="\n")
    except DesignError as why:
        print(f"embed: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

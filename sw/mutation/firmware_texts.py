# SPDX-License-Identifier: Apache-2.0
"""Prints texts of mutants of a C source of the firmware, as a list in JSON, for mutation.firmware.

PYTHONPATH=build/mutators python -m mutation.firmware_texts FILE COUNT SEED

libclang reads the source with the macros of the image `axis`. A fault is

- another operator of the same kind: + and -, * and /, & and |, << and >>, a comparison, && and ||,
  and the assignments with them;
- an operator !, ~ or - that is gone;
- a number that is one more, or one less;
- the condition of an if, a loop or a ?: that is negated;
- a statement that is gone: a call, an assignment, break, continue.

Nothing changes inside a macro or outside a function, and each text compiles.
"""

import json
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from clang.cindex import Cursor, CursorKind, Diagnostic, Index, TranslationUnit

from firmware import build as firmware_build
from mutation.sources import drawn
from twin.build import FIRMWARE
from twin.compiled import host_library

ARGUMENTS = [
    "-std=c11",
    f"-I{FIRMWARE}",
    "-DMOIRE_REGISTER_ACCESS",
    *firmware_build.defines_of("axis", update=True),
]
OTHERS = {  # what may stand in place of an operator
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "%": "/",
    "&": "|",
    "|": "&",
    "^": "|",
    "<<": ">>",
    ">>": "<<",
    "<": "<= >=",
    "<=": "< >",
    ">": ">= <=",
    ">=": "> <",
    "==": "!=",
    "!=": "==",
    "&&": "||",
    "||": "&&",
    "+=": "-=",
    "-=": "+=",
    "*=": "/=",
    "/=": "*=",
    "&=": "|=",
    "|=": "&=",
    "^=": "|=",
    "<<=": ">>=",
    ">>=": "<<=",
    "++": "--",
    "--": "++",
}
GONE = ("!", "~", "-")
BINARY = (CursorKind.BINARY_OPERATOR, CursorKind.COMPOUND_ASSIGNMENT_OPERATOR)
CONDITIONAL = {  # which child is the condition
    CursorKind.IF_STMT: 0,
    CursorKind.WHILE_STMT: 0,
    CursorKind.DO_STMT: 1,
    CursorKind.CONDITIONAL_OPERATOR: 0,
}
LEAVING = (CursorKind.BREAK_STMT, CursorKind.CONTINUE_STMT)
DOING = (CursorKind.CALL_EXPR, *BINARY, CursorKind.UNARY_OPERATOR)
NUMBER = re.compile(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)")


@dataclass(frozen=True)
class Change:
    """Bytes begin … end of the source are others."""

    begin: int
    end: int
    new: str

    def text(self, source: bytes) -> str:
        """The source with the change."""
        return (source[: self.begin] + self.new.encode() + source[self.end :]).decode()


def bounds(cursor: Cursor) -> tuple[int, int]:
    """Where a part of the source begins and ends."""
    return cursor.extent.start.offset, cursor.extent.end.offset


def of_binary(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """Other operators between two operands."""
    left, right = cursor.get_children()
    begin, end = left.extent.end.offset, right.extent.start.offset
    between = source[begin:end].decode()
    operator = between.strip()
    at = begin + len(between) - len(between.lstrip())
    for other in OTHERS.get(operator, "").split():
        yield Change(at, at + len(operator), other)


def of_unary(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """An operator before or after its operand that is another one, or gone."""
    [operand] = cursor.get_children()
    (begin, end), (low, high) = bounds(cursor), bounds(operand)
    before, after = source[begin:low].decode().strip(), source[high:end].decode().strip()
    if before in GONE:
        yield Change(begin, begin + len(before), "")
    elif before in ("++", "--"):
        yield Change(begin, begin + 2, OTHERS[before])
    elif after in ("++", "--"):
        yield Change(end - 2, end, OTHERS[after])


def of_number(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """A number more and less one."""
    begin, end = bounds(cursor)
    found = NUMBER.fullmatch(source[begin:end].decode())
    if found:
        value = int(found[1], 0)
        for other in (value + 1, value - 1):
            if other >= 0:
                text = hex(other) if found[1].lower().startswith("0x") else str(other)
                yield Change(begin, end, text + found[2])


def of_condition(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """A condition that is negated."""
    condition = list(cursor.get_children())[CONDITIONAL[cursor.kind]]
    begin, end = bounds(condition)
    yield Change(begin, end, f"!({source[begin:end].decode()})")


def of_statements(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """A statement of a block that is gone."""
    for statement in cursor.get_children():
        begin, end = bounds(statement)
        if statement.kind in DOING and source[end : end + 1] == b";":
            yield Change(begin, end, "")


def of_cursor(cursor: Cursor, source: bytes) -> Iterator[Change]:
    """The faults of one part of a function."""
    if cursor.kind in BINARY:
        yield from of_binary(cursor, source)
    elif cursor.kind == CursorKind.UNARY_OPERATOR:
        yield from of_unary(cursor, source)
    elif cursor.kind == CursorKind.INTEGER_LITERAL:
        yield from of_number(cursor, source)
    elif cursor.kind in CONDITIONAL:
        yield from of_condition(cursor, source)
    elif cursor.kind == CursorKind.COMPOUND_STMT:
        yield from of_statements(cursor, source)
    elif cursor.kind in LEAVING:
        yield Change(*bounds(cursor), "")


@cache
def headers() -> list[str]:
    """Where the headers of the compiler are: libclang has none."""
    asked = [*host_library.compiler(), "-print-file-name=include"]
    found = subprocess.run(asked, check=True, capture_output=True, text=True)
    return ["-isystem", found.stdout.strip()]


def parsed(file: Path, text: str | None = None) -> TranslationUnit:
    """The source, or another text in its place."""
    instead = None if text is None else [(str(file), text)]
    return Index.create().parse(str(file), [*ARGUMENTS, *headers()], instead)


def compiles(file: Path, text: str) -> bool:
    """Whether a text of the source has no error."""
    return all(d.severity < Diagnostic.Error for d in parsed(file, text).diagnostics)


def changes(file: Path) -> dict[int, list[Change]]:
    """{place: faults there}"""
    source, found = file.read_bytes(), dict[int, list[Change]]()
    for top in parsed(file).cursor.get_children():
        if top.kind != CursorKind.FUNCTION_DECL or str(top.location.file) != str(file):
            continue
        for cursor in top.walk_preorder():
            for change in of_cursor(cursor, source):
                found.setdefault(change.begin, []).append(change)
    return found


def texts(file: Path, count: int, draw: random.Random) -> list[str]:
    """So many texts with one fault each: first one at each place, then further ones."""
    source = file.read_bytes()
    made = (change.text(source) for change in drawn(changes(file), draw))
    found: dict[str, None] = {}
    for text in made:
        if len(found) == count:
            break
        if text not in found and compiles(file, text):
            found[text] = None
    return list(found)


def main(file: Path, count: int, seed: int) -> None:
    draw = random.Random(f"{file.name} {seed}")
    print(json.dumps(texts(file, count, draw)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))

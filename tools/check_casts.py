# SPDX-License-Identifier: Apache-2.0
"""Size casts that Yosys reads otherwise than the standard and the simulators do.

`8'(word)` has 8 bits. Yosys gives them to it, but takes an expression around it for as wide as
`word` was, so that `(8'(word) + step) >> 1` keeps the carry that an adder of 8 bits drops, and
`{a, 8'(word) ^ b}` puts `a` too far to the left. It does no harm where an assignment cuts the
result. Elsewhere the cut value needs a name: `wire [7:0] low = 8'(word);`.

The modules are read with their default parameters, with all features and with none. Casts of
constants are as they should be.

    python -m tools.check_casts          lists the others; exit code 1 when there is any
"""

import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pyslang
from pyslang import ast, syntax

from tools import ROOT, exit_code

FEATURE = re.compile(r"^\s*parameter\s+int\s+(HAS_\w+)", re.MULTILINE)
Kind, Binary, Unary = ast.ExpressionKind, ast.BinaryOperator, ast.UnaryOperator
CARRY = {Binary.Add, Binary.Subtract, Binary.Multiply, Binary.BinaryXnor}  # bits above the result
SHIFTS_LEFT = {Binary.LogicalShiftLeft, Binary.ArithmeticShiftLeft}
BITWISE = {Binary.BinaryAnd, Binary.BinaryOr, Binary.BinaryXor}


def plain(expression: Any) -> Any:
    """An expression without the conversions that the standard adds."""
    while expression.kind == Kind.Conversion and expression.isImplicit:
        expression = expression.operand
    return expression


def width(expression: Any) -> int:
    """Its bits, as if it stood alone."""
    return int(expression.type.bitWidth)


def constant(expression: Any) -> bool:
    """Whether it names parameters and numbers of generated blocks only, if anything."""
    names: list[Any] = []
    expression.visit(lambda e: names.append(e) if isinstance(e, ast.ValueExpressionBase) else None)
    return all(name.symbol.kind == ast.SymbolKind.Parameter for name in names)


def cuts(expression: Any, above: bool = False) -> Iterator[Any]:
    """The casts to fewer bits that widen the operators between them and this expression; `above`:
    what these operators give has bits above those of the cast that differ.
    """
    e = plain(expression)
    if e.kind == Kind.BinaryOp and e.op in CARRY | BITWISE:
        yield from cuts(e.left, above or e.op in CARRY)
        yield from cuts(e.right, above or e.op in CARRY)
    elif e.kind == Kind.BinaryOp and e.op in SHIFTS_LEFT:
        yield from cuts(e.left, True)
    elif e.kind == Kind.UnaryOp and e.op in (Unary.Minus, Unary.BitwiseNot, Unary.Plus):
        yield from cuts(e.operand, above or e.op != Unary.Plus)
    elif e.kind == Kind.ConditionalOp:
        yield from cuts(e.left, above)
        yield from cuts(e.right, above)
    elif e.kind == Kind.Conversion and above:
        inside = plain(e.operand)
        if width(inside) > width(e) and not constant(inside):
            yield e


def parts(e: Any) -> Iterable[tuple[Any, bool]]:
    """The parts of a node that no assignment cuts, each with whether its width alone matters."""
    if e.kind == Kind.BinaryOp and e.op not in CARRY | BITWISE | SHIFTS_LEFT:
        return [(e.left, False), (e.right, False)]
    if e.kind == Kind.BinaryOp and e.op in SHIFTS_LEFT:
        return [(e.right, False)]
    if e.kind == Kind.UnaryOp and e.op not in (Unary.Minus, Unary.BitwiseNot, Unary.Plus):
        return [(e.operand, False)]
    if e.kind == Kind.ConditionalOp:
        return [(condition.expr, False) for condition in e.conditions]
    if e.kind == Kind.Concatenation:
        return [(part, plain(part).kind != Kind.Conversion) for part in e.operands]
    if e.kind == Kind.ElementSelect:
        return [(e.selector, False)]
    if e.kind == Kind.RangeSelect:
        return [(e.left, False), (e.right, False)]
    if e.kind == Kind.Call:
        return [(part, True) for part in e.arguments]
    return []


def found(paths: Iterable[Path], features: Iterable[str]) -> Iterator[str]:
    """`file:line` of each such cast in these files, whose parameters of these names=values hold."""
    options = ast.CompilationOptions()
    options.topModules = {path.stem for path in paths}
    options.paramOverrides = list(features)
    bag = pyslang.Bag()
    bag.compilationOptions = options
    compilation = ast.Compilation(bag)
    for path in paths:
        compilation.addSyntaxTree(syntax.SyntaxTree.fromFile(str(path)))
    manager = compilation.sourceManager
    rows: list[Any] = []

    def visit(node: Any) -> None:
        if isinstance(node, ast.Expression):
            for part, alone in parts(node):
                rows.extend(cut.sourceRange.start for cut in cuts(part, alone))

    compilation.getRoot().visit(visit)
    for place in rows:
        path = Path(manager.getFileName(place)).resolve()
        yield f"{path.relative_to(ROOT)}:{manager.getLineNumber(place)}"


def problems() -> list[str]:
    """The casts under rtl/ that Yosys reads otherwise, each once."""
    paths = sorted((ROOT / "rtl").rglob("*.sv"))
    names = sorted({name for path in paths for name in FEATURE.findall(path.read_text())})
    rows: set[str] = set()
    for value in (None, 0, 1):
        features = [] if value is None else [f"{name}={value}" for name in names]
        rows.update(found(paths, features))
    return sorted(rows)


def main() -> int:
    return exit_code(f"{row}: Yosys widens what is around this cast; name it" for row in problems())


if __name__ == "__main__":
    sys.exit(main())

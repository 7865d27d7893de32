# SPDX-License-Identifier: Apache-2.0
"""The cocotb tests of a module, and the parameters that they build it with, read from the test file
without running it: the call `run("module", __file__, NAME=value, …)`.
"""

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from embed.design import DesignError, number
from twin.build import ROOT


@dataclass(frozen=True)
class Tests:
    """The tests that have a module as their top."""

    module: str  # dotted name of the test file
    parameters: dict[str, int]  # of the first build; the others have their defaults
    image: str = ""  # firmware that it needs in the parameter FIRMWARE


OWN = {  # where no test of pytest has the module as its top
    "node": Tests(
        "tb.embed.node_line", {"CLK_HZ": 8_000_000, "HAS_SINE": 0, "HAS_DRIVE": 0}, "counter"
    )
}


def constants(tree: ast.Module) -> dict[str, int]:
    """The names at the top of a file that are numbers."""
    found: dict[str, int] = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target, value = node.targets[0], node.value
            pairs = [(target, value)]
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = list(zip(target.elts, value.elts))
            for name, one in pairs:
                if isinstance(name, ast.Name):
                    try:
                        found[name.id] = number(ast.unparse(one).replace("//", "/"), found)
                    except DesignError:
                        continue
    return found


def first_arguments(test: ast.FunctionDef) -> Iterator[tuple[str, ast.expr]]:
    """(argument, its first value) of the parametrized arguments of a test."""
    for decorator in test.decorator_list:
        match decorator:
            case ast.Call(args=[ast.Constant(value=str(names)), ast.List(elts=[first, *_])]):
                split = [name.strip() for name in names.split(",")]
                values = first.elts if isinstance(first, ast.Tuple) else [first]
                yield from zip(split, values)


def call_of(test: ast.FunctionDef, module: str) -> ast.Call | None:
    """The call that builds a module and runs the tests of its file, if the test does nothing else:
    what it prepares before is not there in a simulation by others.
    """
    match test.body:
        case [
            ast.Expr(
                value=ast.Call(
                    func=ast.Name(id="run") | ast.Attribute(attr="run"),
                    args=[ast.Constant(value=top), *_],
                ) as call
            )
        ] if top == module:
            return call
    return None


def chosen(
    call: ast.Call, known: Mapping[str, int], first: Mapping[str, ast.expr]
) -> dict[str, int]:
    """The parameters of a call; a DesignError for one that only a run of the test would give."""
    found: dict[str, int] = {}
    for keyword in call.keywords:
        value = keyword.value
        if isinstance(value, ast.Name):
            value = first.get(value.id, value)
        if keyword.arg is None:  # **parameters
            if not isinstance(value, ast.Dict) or value.keys:
                raise DesignError(f"`{ast.unparse(keyword)}` is known at run time only")
        else:
            found[keyword.arg] = number(ast.unparse(value).replace("//", "/"), known)
    return found


@cache
def of(module: str) -> Tests | None:
    """The cocotb tests of a module, None if there are none with this module itself as their top, or
    if their parameters are known at run time only.
    """
    if module in OWN:
        return OWN[module]
    for file in sorted((ROOT / "tb").rglob(f"test_{module}.py")):
        text = file.read_text(encoding="utf-8")
        tree = ast.parse(text)
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and (call := call_of(node, module)):
                try:
                    parameters = chosen(call, constants(tree), dict(first_arguments(node)))
                except DesignError:
                    return None
                return Tests(dotted(file), parameters) if "@cocotb.test" in text else None
    return None


def dotted(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts)

# SPDX-License-Identifier: Apache-2.0
"""Tests that cannot fail: reads the tests under tb/ without running them, and reports each that

- returns early: a test that does not apply must skip with a reason (bench.needs), or it counts as
  passed;
- compares nothing, or only under a condition: without an assert or a pytest.raises of its own, it
  must call a function of its file or of its imports under tb/ that has one;
- asserts a constant.

    python -m tools.check_tests [FILE …]          exit code 1 when there is any
"""

import argparse
import ast
import sys
from collections.abc import Iterator
from pathlib import Path

from tools import ROOT, exit_code

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
Function = ast.FunctionDef | ast.AsyncFunctionDef
CHECKS = {"raises", "fail", "warns"}  # of pytest: calls that fail where a value is wrong
RUNS = "run"  # bench.run: the tests are in the simulator


def own(function: Function) -> Iterator[ast.AST]:
    """The nodes of a function without those of the functions and classes inside it."""
    todo: list[ast.AST] = list(function.body)
    while todo:
        node = todo.pop()
        yield node
        if not isinstance(node, (*FUNCTIONS, ast.ClassDef, ast.Lambda)):
            todo += ast.iter_child_nodes(node)


def name_of(call: ast.Call) -> str | None:
    """The last name of what is called: `b` of a.b(…)."""
    return (
        call.func.attr
        if isinstance(call.func, ast.Attribute)
        else call.func.id
        if isinstance(call.func, ast.Name)
        else None
    )


def compares(node: ast.AST) -> bool:
    """True for a statement or a call that fails where a value is wrong."""
    if isinstance(node, ast.Assert):
        return not isinstance(node.test, ast.Constant)
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in CHECKS
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "pytest"
    )


def is_cocotb(function: Function) -> bool:
    return any("cocotb.test" in ast.unparse(decorator) for decorator in function.decorator_list)


def is_test(function: Function) -> bool:
    return is_cocotb(function) or (
        isinstance(function, ast.FunctionDef) and function.name.startswith("test_")
    )


def functions_of(tree: ast.AST) -> list[Function]:
    return [node for node in ast.walk(tree) if isinstance(node, FUNCTIONS)]


def imported(tree: ast.AST, files: dict[str, Path]) -> list[Path]:
    """The project's own test files that a test file imports from."""
    names = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    } | {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    return [files[name.split(".")[-1]] for name in names if name and name.split(".")[-1] in files]


def calls_of(function: Function) -> set[str | None]:
    """Names that a function calls, and those of the fixtures that it asks for."""
    return {name_of(node) for node in ast.walk(function) if isinstance(node, ast.Call)} | {
        argument.arg for argument in function.args.args
    }


def checkers(functions: list[Function]) -> set[str]:
    """Names of the functions that compare something, themselves or by what they call."""
    found = {
        function.name for function in functions if any(compares(node) for node in own(function))
    }
    while True:
        more = {
            function.name
            for function in functions
            if function.name not in found and calls_of(function) & found
        }
        if not more:
            return found
        found |= more


def always(statements: list[ast.stmt], checking: set[str]) -> bool:
    """Whether one of the statements compares something whatever the conditions are; a loop is taken
    to run.
    """
    for statement in statements:
        if isinstance(statement, (*FUNCTIONS, ast.ClassDef)):
            continue
        if isinstance(statement, ast.If):
            if always(statement.body, checking) and always(statement.orelse, checking):
                return True
        elif isinstance(
            statement, (ast.For, ast.AsyncFor, ast.While, ast.With, ast.AsyncWith, ast.Try)
        ):
            heads = [item.context_expr for item in getattr(statement, "items", [])]
            if always(statement.body, checking) or any(comparing(head, checking) for head in heads):
                return True
        elif comparing(statement, checking):
            return True
    return False


def comparing(node: ast.AST, checking: set[str]) -> bool:
    return any(
        compares(inner) or (isinstance(inner, ast.Call) and name_of(inner) in checking)
        for inner in ast.walk(node)
    )


def faults(path: Path, files: dict[str, Path]) -> Iterator[tuple[int, str, str]]:
    """(line, name, what is wrong) of the tests of one file; files: {name: path} of what it may
    import.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    known = functions_of(tree)
    for other in imported(tree, files):
        known += functions_of(ast.parse(other.read_text(encoding="utf-8")))
    checking = checkers([function for function in known if not is_test(function)])
    for function in functions_of(tree):
        if not is_test(function):
            continue
        for node in own(function):
            if isinstance(node, ast.Return):
                yield node.lineno, function.name, "returns early: skip with a reason (bench.needs)"
            if isinstance(node, ast.Assert) and isinstance(node.test, ast.Constant):
                yield node.lineno, function.name, "asserts a constant"
        fixtures = {argument.arg for argument in function.args.args} & checking
        if not fixtures and not always(
            function.body, checking | (set() if is_cocotb(function) else {RUNS})
        ):
            yield function.lineno, function.name, "compares nothing, or only under a condition"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("files", nargs="*", type=Path, help="test files; default: all under tb/")
    chosen = parser.parse_args(arguments).files
    files = {
        path.stem: path for path in (ROOT / "tb").rglob("*.py") if not path.name.startswith("test_")
    }
    return exit_code(
        f"{path}:{line}: {name} {what}".removeprefix(f"{ROOT}/")
        for path in chosen or sorted((ROOT / "tb").rglob("test_*.py"))
        for line, name, what in faults(path, files)
    )


if __name__ == "__main__":
    sys.exit(main())

"""Functions stay short and kernels narrow: wide ones take long to read and to compile."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Final

import pytest

import planner_core
from planner_core import jit

CORE: Final = Path(planner_core.__file__).parent
MODULES: Final = {str(path.relative_to(CORE)): path for path in sorted(CORE.rglob("*.py"))}

_KERNELS: Final = {
    name
    for name, each in vars(jit).items()
    if callable(each) and getattr(each, "__annotations__", {}).get("function") == "F"
}
_MOST_LINES, _MOST_LINES_OF_A_KERNEL, _MOST_ARGUMENTS = 60, 100, 10


def lines_of(function: ast.FunctionDef, source: list[str]) -> int:
    """Return a function's number of lines without docstring, comments and blank lines."""
    first, last = function.lineno, function.end_lineno or function.lineno
    docstring = range(0)
    if ast.get_docstring(function) is not None:
        docstring = range(function.body[0].lineno, (function.body[0].end_lineno or 0) + 1)
    code = (source[at - 1].strip() for at in range(first, last + 1) if at not in docstring)
    return sum(1 for line in code if line and not line.startswith("#"))


def is_kernel(function: ast.FunctionDef) -> bool:
    """Return whether a function is compiled."""
    return any(ast.unparse(each) in _KERNELS for each in function.decorator_list)


def test_all_kinds_of_kernel_are_known() -> None:
    assert {"kernel", "inner", "borrowing", "borrowing_inner", "inlined", "templated"} <= _KERNELS
    modules = [ast.parse(path.read_text(encoding="utf-8")) for path in MODULES.values()]
    functions = [f for m in modules for f in ast.walk(m) if isinstance(f, ast.FunctionDef)]
    assert sum(map(is_kernel, functions)) > 200


@pytest.mark.parametrize("module", MODULES)
def test_functions_are_short_and_kernels_take_few_arguments(module: str) -> None:
    text = MODULES[module].read_text(encoding="utf-8")
    source = text.splitlines()
    for function in ast.walk(ast.parse(text)):
        if not isinstance(function, ast.FunctionDef):
            continue
        most = _MOST_LINES_OF_A_KERNEL if is_kernel(function) else _MOST_LINES
        assert lines_of(function, source) <= most, function.name
        arguments = len(function.args.args) + len(function.args.kwonlyargs)
        assert not is_kernel(function) or arguments <= _MOST_ARGUMENTS, function.name

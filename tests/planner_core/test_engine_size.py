"""The engine stays small: its constants, its functions and its kernels are counted."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Final

import pytest

import planner_core.certified
from planner_core.certified.tuning import Tuning

ENGINE: Final = Path(planner_core.certified.__file__).parent
MODULES: Final = {str(path.relative_to(ENGINE)): path for path in sorted(ENGINE.rglob("*.py"))}
NUMBERS: Final = {"signs.py", "sizes.py", "tolerances.py", "tuning.py"}
"""Modules whose business is numbers."""

_KERNELS: Final = {"kernel", "borrowing", "inlined"}
_MOST_CONSTANTS: Final = 60
_MOST_LINES, _MOST_LINES_OF_A_KERNEL, _MOST_ARGUMENTS = 60, 100, 10
_ALLOWED: Final = {"VERSION"}  # of documents
_LARGER: Final = {
    "dp/forward_labels.py most_value": (101, 11),
    "dp/forward_labels.py _take": (100, 13),
    "dp/start_labels.py _insert": (100, 11),
    "lns/resource_labels.py _extend": (100, 11),
}
"""Lines and arguments of kernels that are larger still: they may not grow, and none may join."""


def lines_of(function: ast.FunctionDef, source: list[str]) -> int:
    """Return how many lines of code a function has: neither docstring, comments nor blank ones."""
    first, last = function.lineno, function.end_lineno or function.lineno
    docstring = range(0)
    if ast.get_docstring(function) is not None:
        docstring = range(function.body[0].lineno, (function.body[0].end_lineno or 0) + 1)
    code = (source[at - 1].strip() for at in range(first, last + 1) if at not in docstring)
    return sum(1 for line in code if line and not line.startswith("#"))


def is_kernel(function: ast.FunctionDef) -> bool:
    """Return whether a function is compiled."""
    return any(ast.unparse(each) in _KERNELS for each in function.decorator_list)


def numbers_named_in(tree: ast.Module) -> Iterator[str]:
    """Yield the names at the top of a module that stand for numbers written there."""
    for statement in tree.body:
        if isinstance(statement, ast.Assign):
            targets, value = statement.targets, statement.value
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            targets, value = [statement.target], statement.value
        else:
            continue
        if _is_number(value):
            yield from (ast.unparse(target) for target in targets)


def _is_number(value: ast.expr) -> bool:
    if isinstance(value, ast.Tuple):
        return any(map(_is_number, value.elts))
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) or _is_number(value.right)
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float)


def test_numbers_are_found_in_all_their_forms() -> None:
    source = "A = 1\nB: float = -0.5\nC, D = 2, 3\nE = (1, 2)\nF = 2 * X\nG = TUNING.tie\nH = 'x'\n"
    assert list(numbers_named_in(ast.parse(source))) == ["A", "B", "(C, D)", "E", "F"]


def test_constants_are_few_and_each_says_what_it_is() -> None:
    names = [each.name for each in fields(Tuning)]
    assert len(names) <= _MOST_CONSTANTS
    described = (Tuning.__doc__ or "").split("\n")
    listed = {name for line in described for name in line.strip().split(", ")}
    assert set(names) <= listed


def test_every_constant_is_read() -> None:
    engine = "".join(path.read_text(encoding="utf-8") for path in MODULES.values())
    unread = [each.name for each in fields(Tuning) if f"TUNING.{each.name}" not in engine]
    assert not unread


@pytest.mark.parametrize("module", sorted(set(MODULES) - NUMBERS))
def test_numbers_that_steer_stand_in_the_tuning_alone(module: str) -> None:
    tree = ast.parse(MODULES[module].read_text(encoding="utf-8"))
    assert set(numbers_named_in(tree)) <= _ALLOWED


@pytest.mark.parametrize("module", MODULES)
def test_functions_are_short_and_kernels_take_few_arguments(module: str) -> None:
    text = MODULES[module].read_text(encoding="utf-8")
    source = text.splitlines()
    for function in ast.walk(ast.parse(text)):
        if not isinstance(function, ast.FunctionDef):
            continue
        most, most_arguments = _MOST_LINES, None
        if is_kernel(function):
            usual = (_MOST_LINES_OF_A_KERNEL, _MOST_ARGUMENTS)
            most, most_arguments = _LARGER.get(f"{module} {function.name}", usual)
        assert lines_of(function, source) <= most, function.name
        arguments = len(function.args.args) + len(function.args.kwonlyargs)
        assert most_arguments is None or arguments <= most_arguments, function.name

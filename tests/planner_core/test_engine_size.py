"""The engine stays small: the number of its constants is limited."""

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
"""Modules that may define numbers."""

_MOST_CONSTANTS: Final = 60
_ALLOWED: Final = {"VERSION"}  # document versions


def numbers_named_in(tree: ast.Module) -> Iterator[str]:
    """Yield the module-level names to which a number is assigned."""
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

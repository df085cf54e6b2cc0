"""Every error code that the sources can return is explained."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import planner_core
import service
from service.problems.kinds import KINDS

COMMAND_LINE = {"solve.py"}  # returns no problem documents
RAISING = {"Fault", "ServiceError", "InvalidElements", "InvalidScenario", "InvalidParameters"}


def codes_in(source: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", None) in RAISING:
            keywords = [keyword.value for keyword in node.keywords if keyword.arg == "code"]
            for value in [*node.args[:1], *keywords]:
                if isinstance(value, ast.Constant):
                    yield str(value.value)


def test_every_code_in_the_sources_is_explained() -> None:
    folders = [Path(package.__path__[0]) for package in (planner_core, service)]
    paths = [path for folder in folders for path in folder.rglob("*.py")]
    codes = {code for p in paths if p.name not in COMMAND_LINE for code in codes_in(p)}
    assert {"tle_missing_line", "not_found", "horizon_inverted"} <= codes
    assert codes - set(KINDS) == set()


def test_every_explanation_is_a_sentence_and_every_status_an_error() -> None:
    for code, kind in KINDS.items():
        assert kind.explanation.endswith("."), code
        assert 400 <= kind.status <= 599, code
        assert kind.title[0].isupper(), code

"""What is stored by other code is told from what is stored by this."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

from planner_core.sources import PACKAGE, fingerprint, opportunity_sources

_NO_MATTER = {
    # They name what can go wrong or may be spent, make loops fast, or come after opportunities.
    "budget.py", "bundles.py", "errors.py", "jit.py", "kernel_cache.py", "kernel_folder.py",
    "pins.py", "sources.py", "worth.py",
}  # fmt: skip


def _imported(path: Path) -> set[Path]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("planner_core"):
            assert node.module is not None
            place = PACKAGE.parent / node.module.replace(".", "/")
            names = [place / alias.name for alias in node.names]
            for one in (place, *names):
                file = one / "__init__.py" if one.is_dir() else one.with_suffix(".py")
                if file.is_file():
                    found.add(file)
    return found


def test_all_that_makes_opportunities_counts() -> None:
    counted = set(opportunity_sources())
    access = PACKAGE / "access"
    seen, open_ = (
        set(), {access / "scenario_opportunities.py", access / "opportunities_after.py"}
    )  # fmt: skip
    while open_:
        path = open_.pop()
        seen.add(path)
        open_ |= _imported(path) - seen
    rest = {p.relative_to(PACKAGE) for p in seen - counted}
    assert {p.as_posix() for p in rest} <= _NO_MATTER
    assert PACKAGE / "data" / "eop.csv" in counted


def test_an_edit_gives_another_version(tmp_path: Path) -> None:
    package = tmp_path / "planner_core"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    before = fingerprint(package, opportunity_sources(package))
    assert before == fingerprint(PACKAGE, opportunity_sources())
    edited = package / "access" / "opportunities.py"
    edited.write_text(edited.read_text() + "\n# edited\n")
    assert fingerprint(package, opportunity_sources(package)) != before
    beside = package / "solvers" / "rule.py"
    middle = fingerprint(package, opportunity_sources(package))
    beside.write_text(beside.read_text() + "\n# edited\n")
    assert fingerprint(package, opportunity_sources(package)) == middle

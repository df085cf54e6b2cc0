"""The modules and folders that pages and docstrings name exist, and the index is complete."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]
_CORE = _ROOT / "planner_core"
# Pages give locations relative to the core, to ``certified`` or to its neighbourhood search.
_FOLDERS = (_ROOT, _CORE, _CORE / "certified", _CORE / "certified" / "lns")


@pytest.mark.parametrize("page", ["architecture.md", "glossary.md"])
def test_every_module_and_folder_that_a_page_names_exists(page: str) -> None:
    text = (_ROOT / "docs" / page).read_text()
    named = set(re.findall(r"`((?:\w+/)*\w+(?:\.py|/))`", text))
    assert len(named) > 20
    missing = [name for name in named if not any((f / name).exists() for f in _FOLDERS)]
    assert missing == []


def test_the_index_names_every_page() -> None:
    index = (_ROOT / "docs" / "README.md").read_text()
    pages = [p for p in (_ROOT / "docs").glob("*.md") if p.name != "README.md"]
    assert [p.name for p in pages if f"({p.name})" not in index] == []


def test_every_module_that_docstrings_and_comments_name_exists() -> None:
    files = [path for root in ("planner_core", "service") for path in (_ROOT / root).rglob("*.py")]
    named = {
        (path.relative_to(_ROOT).as_posix(), name)
        for path in files
        for name in re.findall(r"`((?:planner_core|service)(?:\.\w+)+)`", path.read_text())
    }
    assert len(named) > 20
    assert [place for place in sorted(named) if not _is_there(place[1].split("."))] == []


def _is_there(parts: list[str]) -> bool:
    """Return whether the name is a folder, a module, or defined in one."""
    whole, owner = _ROOT.joinpath(*parts), _ROOT.joinpath(*parts[:-1])
    if whole.is_dir() or whole.with_suffix(".py").is_file():
        return True
    held = [owner.with_suffix(".py"), owner / "__init__.py"]
    return any(parts[-1] in path.read_text() for path in held if path.is_file())

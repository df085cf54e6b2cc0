"""The record of compiled kernels, and the work that it saves a process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from service.jobs import compiled


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(compiled, "kernel_folder", lambda: tmp_path / "kernels")
    return tmp_path / "kernels"


@pytest.mark.usefixtures("folder")
def test_kernels_are_ready_until_a_source_is_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not compiled.is_ready("all")
    assert compiled.stamps("all") is None
    compiled.note("all", "abc")
    assert compiled.is_ready("all")
    assert not compiled.is_ready("demonstration")
    monkeypatch.setattr(compiled, "_sources", lambda: "edited")
    assert not compiled.is_ready("all")
    # The stamps tell whether the edit affects a kernel.
    assert compiled.stamps("all") == "abc"


def test_a_note_that_is_cut_short_is_none(folder: Path) -> None:
    compiled.note("all", "abc")
    for rest in ("abc\n", ""):
        (folder / "all.ready").write_text(rest)
        assert not compiled.is_ready("all")


def test_where_nothing_can_be_written_nothing_is_noted(folder: Path) -> None:
    folder.write_text("a file where the folder would be")
    compiled.note("all", "abc")
    assert folder.read_text() == "a file where the folder would be"


def test_who_only_asks_imports_no_compiler() -> None:
    asking = "import sys, service.commands.demo; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", asking], check=True)

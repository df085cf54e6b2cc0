"""The page on the client: its code is run as printed, and its output compared with the page's."""

from __future__ import annotations

import io
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from tests.service.serving import serving

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "client.md"
BLOCK = re.compile(r"```(python|sh|text)\n(.*?)```", re.S)


def _run_python(source: str, names: dict[str, object]) -> str:
    with redirect_stdout(io.StringIO()) as printed:
        exec(compile(source, str(PAGE), "exec"), names)
    return printed.getvalue()


def _run_command(line: str, folder: Path) -> str:
    program, *arguments = shlex.split(line)
    assert program == "slewline"
    ran = subprocess.run(
        [sys.executable, "-m", "service", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def _without_seconds(text: str) -> list[str]:
    """Return lines without the seconds of a run and the space they take."""
    return [re.sub(r" +\d+\.\d{3} +\d+\.\d{2} ", " ", line) for line in text.splitlines()]


def test_every_command_prints_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    printed, shown = "", ""
    with serving(tmp_path, "serve", "--workers", "1") as (_, line):
        monkeypatch.setenv("SLEWLINE_URL", line.split()[-1])
        for language, source in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
            match language:
                case "python":
                    printed += _run_python(source, names)
                case "sh":
                    printed += _run_command(source, tmp_path)
                case "text":
                    shown += source
    assert _without_seconds(printed) == _without_seconds(shown)
    assert (tmp_path / "morning.json").exists()
    assert (tmp_path / "evening.json").exists()

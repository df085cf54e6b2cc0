"""The README's walk through the API runs as it is printed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.service.serving import serving

ROOT = Path(__file__).resolve().parents[2]
WITHIN_S = 120.0


def _walk(url: str) -> str:
    """Return the shell commands of the README, for a service at ``url``."""
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    commands = "\n".join(block for block in blocks if "make demo" not in block)
    return commands.replace("http://127.0.0.1:8000", url).replace(
        ".venv/bin/slewline", f"{sys.executable} -m service"
    )


@pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in ("bash", "curl", "awk", "python3")),
    reason="the walk needs bash, curl, awk and python3",
)
def test_every_command_of_the_walk_works(tmp_path: Path) -> None:
    (tmp_path / "service").symlink_to(ROOT / "service")
    with serving(tmp_path, "serve") as (_, line):
        ran = subprocess.run(
            ["bash", "-eu", "-c", _walk(line.split()[-1])],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=WITHIN_S,
            check=False,
        )
    assert ran.returncode == 0, ran.stderr
    answers = [
        '"kind": "contact"',
        '"bound_proof"',
        '"mode": "collect"',
        '"code": "tle_line_length"',
    ]
    assert [part for part in answers if part not in ran.stdout] == []
    assert re.search(r"^rule .* valid$", ran.stdout, re.M)

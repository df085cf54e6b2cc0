"""How the demonstration waits for the service it starts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from service.commands.demo import _url_when_ready
from service.commands.outcome import Failed


def started(code: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)


def test_what_a_library_prints_before_is_passed_over(tmp_path: Path) -> None:
    with started("print('a banner'); print('Slewline is ready at http://h:1')") as process:
        assert _url_when_ready(process, tmp_path / "log") == "http://h:1"


def test_a_service_that_ends_is_told_with_its_status_and_last_words(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_text("".join(f"line {number}\n" for number in range(100)))
    with (
        started("print('a banner'); raise SystemExit(3)") as process,
        pytest.raises(Failed, match=r"(?s)status 3; see .*line 80.*line 99") as caught,
    ):
        _url_when_ready(process, log)
    assert "line 79" not in str(caught.value)

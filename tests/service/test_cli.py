"""The command line: what it refuses, what it prints, and its exit status."""

from __future__ import annotations

import json
import logging
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import sqlalchemy as sa

from service.commands.cli import main
from service.commands.outcome import FAILED, OK, WRONG_INPUT

COMMANDS = (
    "serve", "api", "worker", "migrate", "backup", "demo", "solve", "compare-spacing", "plan",
    "keys", "openapi",
)  # fmt: skip


@pytest.fixture(autouse=True)
def _own_logging() -> Iterator[None]:
    """Commands log to the current standard error, which is replaced after the test."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)


@pytest.fixture
def database_url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'slewline.db'}"


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    printed = capsys.readouterr().out
    assert ended.value.code == 0
    assert [name for name in COMMANDS if f"\n    {name}" in printed] == list(COMMANDS)


@pytest.mark.parametrize("arguments", [[], ["fly"], ["solve"], ["serve", "--port", "many"]])
def test_wrong_usage_ends_with_status_2(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == WRONG_INPUT


def test_help_loads_neither_the_web_framework_nor_the_compiler() -> None:
    script = "import sys, service.commands.cli; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = set(ran.stdout.split())
    assert "service.commands.cli" in loaded
    assert loaded.isdisjoint({"fastapi", "numba", "numpy", "sqlalchemy", "dbos", "uvicorn"})


@pytest.mark.parametrize("command", [["migrate"], ["keys", "list"], ["api", "--port", "0"]])
def test_a_database_that_is_away_is_told_in_words(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = "postgresql+psycopg://nobody@127.0.0.1:1/none"
    assert main([*command, "--database-url", nowhere]) == FAILED
    assert capsys.readouterr().err.endswith("slewline: The database cannot be reached.\n")


@pytest.mark.parametrize("command", ["serve", "api"])
@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7", "planner.example"])
def test_listening_beyond_this_machine_without_a_key_is_refused(
    command: str, host: str, capsys: pytest.CaptureFixture[str], database_url: str
) -> None:
    status = main([command, "--host", host, "--port", "0", "--database-url", database_url])
    assert status == WRONG_INPUT
    said = capsys.readouterr().err
    assert f"Will not listen on {host} without a key" in said
    assert said.count("\n") == 1


def test_a_taken_port_is_named(capsys: pytest.CaptureFixture[str], database_url: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        status = main(["serve", "--port", str(port), "--database-url", database_url])
    assert status == FAILED
    assert f"port {port}" in capsys.readouterr().err


def test_a_wrong_option_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--port", "70000"]) == WRONG_INPUT
    assert "--port" in capsys.readouterr().err


def test_a_wrong_variable_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SLEWLINE_LEASE_S", "-1")
    assert main(["serve"]) == WRONG_INPUT
    assert "SLEWLINE_LEASE_S" in capsys.readouterr().err


def test_migrate_makes_the_tables_of_service_and_queue_and_may_be_repeated(
    database_url: str,
) -> None:
    assert main(["migrate", "--database-url", database_url]) == OK
    assert main(["migrate", "--database-url", database_url]) == OK
    engine = sa.create_engine(database_url)
    tables = set(sa.inspect(engine).get_table_names())
    engine.dispose()
    assert {"job", "scenario", "workflow_status"} <= tables


def test_an_option_outweighs_the_environment(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, database_url: str
) -> None:
    monkeypatch.setenv("SLEWLINE_DATABASE_URL", f"sqlite:///{tmp_path / 'other.db'}")
    assert main(["migrate", "--database-url", database_url]) == OK
    assert [path.name for path in tmp_path.glob("*.db")] == ["slewline.db"]


def test_openapi_prints_the_description_and_touches_no_database(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SLEWLINE_DATABASE_URL", f"sqlite:///{tmp_path / 'data' / 'slewline.db'}")
    assert main(["openapi"]) == OK
    description = json.loads(capsys.readouterr().out)
    assert description["openapi"].startswith("3.1")
    assert "/health/live" in description["paths"]
    assert list(tmp_path.iterdir()) == []

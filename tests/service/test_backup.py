"""``slewline backup``: what it writes, and what it refuses. With jobs: jobs/test_restore.py."""

from __future__ import annotations

import sqlite3
import stat
from contextlib import closing
from pathlib import Path

import pytest

from service.commands.cli import main
from service.commands.outcome import FAILED, OK
from service.db.session import Database
from service.settings import Settings


def back_up(settings: Settings, file: Path) -> int:
    return main(["backup", str(file), "--database-url", settings.database_url])


def test_a_backup_is_one_file_of_what_was_committed(settings: Settings, tmp_path: Path) -> None:
    """A writer is in the middle of a transaction, and continues afterwards."""
    file = tmp_path / "backup.db"
    database = Database(settings.database_url)
    insert = (
        "INSERT INTO target_catalog (id, name, num_targets, created_at) "
        "VALUES ('{}', 'c', 0, '2026-01-01 00:00:00.000000')"
    )
    with database.engine.begin() as connection:
        connection.exec_driver_sql(insert.format("before"))
    with database.engine.begin() as connection:
        connection.exec_driver_sql(insert.format("after"))
        assert back_up(settings, file) == OK
    database.close()
    assert sorted(path.name for path in tmp_path.glob("backup*")) == ["backup.db"]
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    with closing(sqlite3.connect(file)) as copy:
        assert copy.execute("SELECT id FROM target_catalog").fetchall() == [("before",)]
        assert copy.execute("PRAGMA journal_mode").fetchone() == ("delete",)


@pytest.mark.parametrize(
    ("url", "name", "reason"),
    [
        ("postgresql+psycopg://nobody@localhost/x", "new.db", "pg_dump --format=custom"),
        ("sqlite:///{folder}/none.db", "new.db", "There is no database"),
        ("sqlite:///{folder}/service.db", "service.db", "exists and is not overwritten"),
        ("sqlite:///{folder}/service.db", "no/such/folder.db", "No such file or directory"),
    ],
)
def test_what_cannot_be_done_is_refused_in_words(
    url: str,
    name: str,
    reason: str,
    settings: Settings,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = settings.model_copy(update={"database_url": url.format(folder=tmp_path)})
    assert back_up(given, tmp_path / name) == FAILED
    assert reason in capsys.readouterr().err
    assert not (tmp_path / "new.db").exists()


def test_a_damaged_database_gives_no_backup(
    settings: Settings, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(sqlite3.connect(tmp_path / "service.db")) as connection:
        connection.execute("PRAGMA foreign_keys = OFF")
        connection.execute("INSERT INTO target VALUES ('nobody', 0, 't', '{}')")
        connection.commit()
    assert back_up(settings, tmp_path / "new.db") == FAILED
    assert "a row of target refers to nothing" in capsys.readouterr().err
    assert not list(tmp_path.glob("new*"))

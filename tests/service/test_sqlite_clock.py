"""DBOS finds the clock function that it needs in every SQLite."""

from __future__ import annotations

from pathlib import Path

import sqlalchemy as sa

from service.db.sqlite_clock import add_sqlite_clock, unixepoch


def test_any_engine_answers_the_time_with_fractions(tmp_path: Path) -> None:
    add_sqlite_clock()
    engine = sa.create_engine(f"sqlite:///{tmp_path / 'a.db'}")
    with engine.begin() as connection:
        connection.exec_driver_sql(
            "CREATE TABLE t (a INT, at INTEGER NOT NULL DEFAULT (unixepoch('subsec') * 1000))"
        )
        connection.exec_driver_sql("INSERT INTO t (a) VALUES (1)")
        stored_ms, now_s = connection.exec_driver_sql(
            "SELECT at, CAST(strftime('%s', 'now') AS INTEGER) FROM t"
        ).one()
    engine.dispose()
    assert abs(stored_ms / 1000.0 - now_s) < 60.0


def test_other_times_than_now_are_null_rather_than_wrong() -> None:
    assert unixepoch("2019-01-01") is None
    assert isinstance(unixepoch("now"), int)
    assert isinstance(unixepoch("subsec"), float)

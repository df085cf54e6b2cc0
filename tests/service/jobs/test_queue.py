"""Corrections that the queue's library needs."""

from __future__ import annotations

from pathlib import Path

import psycopg
import pytest
import sqlalchemy as sa

from service.jobs.queue import make_queue_engine


def test_a_server_that_is_gone_counts_as_a_lost_connection(tmp_path: Path) -> None:
    """This mark makes DBOS try again; the driver's text ("connection is bad") would not."""
    url = f"postgresql+psycopg://nobody@/none?host={tmp_path}"
    plain, helped = sa.create_engine(url), make_queue_engine(url)
    assert helped is not None
    for engine, is_marked in ((plain, False), (helped, True)):
        with pytest.raises(sa.exc.OperationalError) as caught:
            engine.connect()
        assert caught.value.connection_invalidated is is_marked
        engine.dispose()


@pytest.mark.parametrize(
    ("error", "is_marked"),
    [
        (psycopg.OperationalError("connection is bad: no such file"), True),
        (psycopg.errors.AdminShutdown("terminating connection"), True),
        (psycopg.errors.QueryCanceled("statement timeout"), False),
        (psycopg.errors.UniqueViolation("duplicate key"), False),
    ],
)
def test_only_a_lost_connection_is_marked(
    error: Exception, is_marked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = make_queue_engine("postgresql+psycopg://nobody@/none?host=/nowhere")
    assert engine is not None

    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(psycopg.Connection, "connect", fail)
    with pytest.raises(sa.exc.DBAPIError) as caught:
        engine.connect()
    assert caught.value.connection_invalidated is is_marked


def test_sqlite_needs_no_help() -> None:
    assert make_queue_engine("sqlite:///any.db") is None

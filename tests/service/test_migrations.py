"""Data written by an older version, as this version reads it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.config import Config

from service.answers import store as answer_store
from service.answers.chunks import (
    TIMELINE,
    Chunk,
    contents_of,
    proof_chunks,
    target_chunks,
)
from service.answers.rendering import figures_of
from service.db.migrate import config_on
from service.db.rows import JobResultRow
from service.db.session import Database
from tests.service.answers import chunks_of_timeline
from tests.service.jobs.conftest import SERVER_URL, create_database
from tests.service.jobs.work import EMPTY
from tests.service.test_chunks import target, timeline_of

Change = Callable[[Config, str], None]

AT = datetime(2026, 1, 1, tzinfo=UTC)
JOB: dict[str, Any] = {
    "scenario_id": "s", "tenant": "local", "state": "succeeded", "solver": "rule", "params": {},
    "seed": 0, "limits": {}, "priority": 5, "dispatch": 1, "run": 1, "lost_runs": 0,
    "dispatched_at": AT, "cancel_requested": False, "version": 1, "created_at": AT,
}  # fmt: skip
OLD = ("timeline", "targets", "proof")


def answer(*num_actions: int, num_targets: int, proof: str | None) -> dict[str, Any]:
    return {
        "timeline": json.dumps(timeline_of(*num_actions)),
        "targets": json.dumps([target(number) for number in range(num_targets)]),
        "proof": proof,
    }


ANSWERS = {
    "large": answer(3, 401, 0, num_targets=450, proof=json.dumps({"prices": [0.25] * 20_000})),
    "small": answer(1, num_targets=1, proof=None),
    "empty": answer(num_targets=0, proof=None),
}


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    """A database of the version before chunks, with some answers."""
    url = f"sqlite:///{tmp_path / 'old.db'}"
    if SERVER_URL is not None:
        url = create_database(SERVER_URL, "template1")
    database = Database(url)
    move(database, command.upgrade, "0009")
    with database.engine.begin() as connection:
        store(connection, "scenario", id="s", sha256="s", summary={}, content="{}", created_at=AT)
        for job_id, texts in ANSWERS.items():
            store(connection, "job", id=job_id, **JOB)
            store(connection, "job_result", job_id=job_id, created_at=AT, **texts)
    yield database
    database.close()


def store(connection: sa.Connection, table: str, **values: object) -> None:
    """Insert a row into a table as it is at this version."""
    found = sa.Table(table, sa.MetaData(), autoload_with=connection)
    connection.execute(sa.insert(found).values(**values))


def move(database: Database, change: Change, revision: str) -> None:
    """Bring a database to a version."""
    with database.engine.begin() as connection:
        change(config_on(connection), revision)


def test_older_answers_are_cut_into_the_blocks_of_newer_ones(database: Database) -> None:
    move(database, command.upgrade, "head")
    for job_id, texts in ANSWERS.items():
        expected: list[Chunk] = [
            *chunks_of_timeline(json.loads(texts["timeline"])),
            *target_chunks(json.loads(texts["targets"])),
            *proof_chunks(texts["proof"] or ""),
        ]
        with database.reading() as session:
            contents = answer_store.contents(session, job_id, *TIMELINE, "targets", "proof")
            assert answer_store.timeline_of(session, job_id) == texts["timeline"]
            assert answer_store.proof_of(session, job_id) == texts["proof"]
        assert contents == contents_of(expected)
        found = answer_store.texts(database.reading, job_id, contents)
        assert [text for _, text in found] == [chunk.text for chunk in expected]


def test_going_back_restores_every_text(database: Database) -> None:
    move(database, command.upgrade, "head")
    move(database, command.downgrade, "0009")
    with database.engine.begin() as connection:
        rows = connection.exec_driver_sql(f"SELECT job_id, {', '.join(OLD)} FROM job_result")
        assert {row.job_id: {name: getattr(row, name) for name in OLD} for row in rows} == ANSWERS


@pytest.mark.parametrize("revision", ["0009", "0002"])
def test_going_back_and_forth_loses_no_figures(database: Database, revision: str) -> None:
    timeline = {**EMPTY, "satellites": []}
    figures = figures_of(timeline)
    with database.transaction() as session:
        session.execute(sa.text("DELETE FROM job_result"))
    text = json.dumps(timeline)
    with database.engine.begin() as connection:
        of_job = {"job_id": "small", "created_at": AT, "targets": "[]", "proof": None}
        store(connection, "job_result", **of_job, timeline=text, figures=figures)
    move(database, command.downgrade, revision)
    move(database, command.upgrade, "head")
    with database.reading() as session:
        found = session.scalar(sa.select(JobResultRow.figures))
    # Fields unknown to an earlier version are missing there, and null here.
    assert found is not None
    assert figures == dict.fromkeys(figures) | found

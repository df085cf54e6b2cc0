"""The database: migrations, transactions, ids."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from service.db.columns import Row
from service.db.ids import new_id
from service.db.migrate import upgrade
from service.db.rows import BoundRow, TargetCatalogRow, TargetRow, WorkerRow
from service.db.session import Database, make_engine
from service.stores import bound_store


def worker_row(name: str = "w") -> WorkerRow:
    now = datetime.now(UTC)
    return WorkerRow(id=name, started_at=now, seen_at=now)


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    url = f"sqlite:///{tmp_path / 'folder' / 'own.db'}"
    upgrade(url)
    database = Database(url)
    yield database
    database.close()


def test_the_migrations_make_exactly_the_tables_of_the_rows(database: Database) -> None:
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection)
        assert compare_metadata(context, Row.metadata) == []


def test_migrating_from_any_folder_twice_changes_nothing(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with database.transaction() as session:
        session.add(worker_row())
    monkeypatch.chdir(tmp_path)
    upgrade(str(database.engine.url))
    with database.reading() as session:
        assert session.get(WorkerRow, "w") is not None


def test_many_processes_may_migrate_a_new_database_at_once(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'shared.db'}"
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=upgrade, args=(url,)) for _ in range(3)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert [process.exitcode for process in processes] == [0, 0, 0]
    engine = make_engine(url)
    assert "scenario" in sa.inspect(engine).get_table_names()
    engine.dispose()


def test_sqlite_keeps_what_was_committed_and_checks_foreign_keys(database: Database) -> None:
    with database.engine.connect() as connection:
        for pragma, value in (
            ("journal_mode", "wal"),
            ("synchronous", 2),
            ("foreign_keys", 1),
            ("busy_timeout", 30000),
        ):
            assert connection.exec_driver_sql(f"PRAGMA {pragma}").scalar() == value
    orphan = TargetRow(catalog_id="none", position=0, target_id="t", body={})
    with pytest.raises(sa.exc.IntegrityError), database.transaction() as session:
        session.add(orphan)


def test_an_error_rolls_the_whole_transaction_back(database: Database) -> None:
    catalog = TargetCatalogRow(id="c", name="c", num_targets=0, created_at=datetime.now(UTC))

    def write_and_fail() -> None:
        with database.transaction() as session:
            session.add(catalog)
            session.flush()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_and_fail()
    with database.reading() as session:
        assert session.get(TargetCatalogRow, "c") is None


def test_reading_sees_one_snapshot_while_others_write(database: Database) -> None:
    count = sa.select(sa.func.count()).select_from(WorkerRow)
    with database.reading() as reader:
        assert reader.scalar(count) == 0
        with database.transaction() as writer:
            writer.add(worker_row())
        assert reader.scalar(count) == 0
    with database.reading() as reader:
        assert reader.scalar(count) == 1


def test_writers_that_read_first_wait_for_each_other(database: Database) -> None:
    def raise_by_one() -> None:
        with database.transaction() as session:
            row = session.get_one(TargetCatalogRow, "c")
            row.num_targets += 1

    with database.transaction() as session:
        session.add(TargetCatalogRow(id="c", name="c", num_targets=0, created_at=datetime.now(UTC)))
    threads = [threading.Thread(target=raise_by_one) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.reading() as session:
        assert session.get_one(TargetCatalogRow, "c").num_targets == 8


def test_instants_come_back_aware_and_naive_ones_are_refused(database: Database) -> None:
    with database.transaction() as session:
        session.add(worker_row())
    with database.reading() as session:
        assert session.get_one(WorkerRow, "w").seen_at.tzinfo is UTC
    naive = worker_row("n")
    naive.seen_at = naive.seen_at.replace(tzinfo=None)
    with pytest.raises(sa.exc.StatementError), database.transaction() as session:
        session.add(naive)


def test_ids_are_uuid7_and_sort_by_age() -> None:
    made = [new_id() for _ in range(5000)]
    assert made == sorted(set(made))
    assert {(one[14], one[19] in "89ab") for one in made} == {("7", True)}


def test_bounds_of_a_scenario_only_get_better(database: Database) -> None:
    def best() -> str | None:
        with database.reading() as session:
            return bound_store.load(session, "s")

    assert best() is None
    for value, proof, expected in ((5.0, "a", "a"), (7.0, "b", "a"), (4.0, "c", "c")):
        with database.transaction() as session:
            bound_store.save(session, "s", value, proof)
        assert best() == expected
    with database.transaction() as session:
        session.execute(sa.update(BoundRow).values(version="of old", value=0.0))
    assert best() is None
    with database.transaction() as session:
        bound_store.save(session, "s", 9.0, "d")
    assert best() == "d"

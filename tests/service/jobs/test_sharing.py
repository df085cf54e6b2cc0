"""Data that several writers store at once: on PostgreSQL they really compete."""

from __future__ import annotations

import threading

from service.scenarios import freezing as scenario_store
from service.scenarios.freezing import FrozenScenario
from service.stores import bound_store
from tests.service.jobs.conftest import Jobs


def test_the_same_scenario_stored_twice_at_once_is_one(jobs: Jobs) -> None:
    summary: dict[str, list[str]] = {"satellite_ids": [], "ground_station_ids": []}
    frozen = FrozenScenario(content="{}", sha256="1" * 64, name=None, summary=summary)
    found: list[tuple[str, bool]] = []

    def store() -> None:
        with jobs.database.transaction() as session:
            row, is_new = scenario_store.save(session, frozen)
            found.append((row.id, is_new))

    with jobs.database.transaction() as session:
        first, is_new = scenario_store.save(session, frozen)
        assert is_new
        thread = threading.Thread(target=store)
        thread.start()
        thread.join(0.5)
        assert thread.is_alive(), "it waits for the first to end"
    thread.join()
    assert found == [(first.id, False)]


def test_of_bounds_stored_at_once_the_lowest_stays(jobs: Jobs) -> None:
    def store(value: float) -> None:
        with jobs.database.transaction() as session:
            bound_store.save(session, "s", value, f"proof of {value:g}")

    threads = [threading.Thread(target=store, args=(float(v),)) for v in (5, 3, 4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with jobs.database.reading() as session:
        assert bound_store.load(session, "s") == "proof of 3"

"""A scenario's opportunities are stored once."""

from __future__ import annotations

import pytest

from service.stores import opportunity_store
from tests.service.jobs.conftest import Jobs


def save(jobs: Jobs, block: bytes) -> None:
    with jobs.database.transaction() as session:
        opportunity_store.save(session, "0" * 64, block)


def load(jobs: Jobs) -> bytes | None:
    with jobs.database.reading() as session:
        return opportunity_store.load(session, "0" * 64)


def test_the_first_block_stays_and_the_second_does_no_harm(jobs: Jobs) -> None:
    assert load(jobs) is None
    save(jobs, b"first")
    save(jobs, b"second")
    assert load(jobs) == b"first"


def test_a_block_of_another_version_is_replaced(
    jobs: Jobs, monkeypatch: pytest.MonkeyPatch
) -> None:
    save(jobs, b"old")
    monkeypatch.setattr(opportunity_store, "VERSION", "next")
    assert load(jobs) is None
    save(jobs, b"new")
    assert load(jobs) == b"new"

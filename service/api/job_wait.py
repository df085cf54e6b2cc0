"""Waiting for a job to change, without a thread that waits."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Annotated, Final, cast

from fastapi import Depends, Request
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import State

from service.api.etags import matches
from service.api.job_shapes import etag_of_job
from service.api.together import Together
from service.db.rows import JobRow
from service.db.session import Database
from service.problems.kinds import ServiceError
from service.stores import job_store as store
from service.wire.jobs import ACTIVE

LOOK_EVERY_S: Final = 0.1


class Versions(Together[str, int]):
    """The versions of jobs, asked for by all who wait in one query."""

    def __init__(self, state: State):
        def ask(job_ids: Sequence[str]) -> Mapping[str, int]:
            with cast(Database, state.database).asking() as connection:
                return store.versions_of(connection, job_ids)

        super().__init__(ask)


async def _versions(request: Request) -> Versions:
    return cast(Versions, request.app.state.versions)


VersionsDep = Annotated[Versions, Depends(_versions)]


async def wait_for_change(
    database: Database,
    versions: Versions,
    job_id: str,
    known: str | None,
    wait_s: float,
    is_disconnected: Callable[[], Awaitable[bool]],
) -> tuple[JobRow, str]:
    """Return a job and its scenario's hash, at the latest after ``wait_s``.

    Parameters
    ----------
    known
        The client's ``If-None-Match``: what it has seen; None for what is there now.

    Raises
    ------
    ServiceError
        Where there is no such job.
    """
    job, sha256 = await run_in_threadpool(_read, database, job_id)
    seen = etag_of_job(job) if known is None else known
    clock = asyncio.get_running_loop()
    until_s = clock.time() + wait_s
    while job.state in ACTIVE and matches(seen, etag_of_job(job)):
        left_s = until_s - clock.time()
        if left_s <= 0 or await is_disconnected():
            break
        await asyncio.sleep(min(LOOK_EVERY_S, left_s))
        # Only a number is read until it moves: many may wait at once.
        if await versions.get(job_id) != job.version:
            job, sha256 = await run_in_threadpool(_read, database, job_id)
    return job, sha256


def _read(database: Database, job_id: str) -> tuple[JobRow, str]:
    with database.reading() as session:
        job = store.find(session, job_id)
        if job is None:
            raise ServiceError("not_found", f"There is no job {job_id!r}.")
        return job, store.scenario_hashes(session, [job])[job.scenario_id]

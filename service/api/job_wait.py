"""Waiting for a job to change, without a thread that waits."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Final

from service.api.conditional import matches
from service.api.job_shapes import etag_of_job
from service.api.questions import Questions
from service.db.rows import JobRow
from service.stores.finding import no_such
from service.wire.jobs import ACTIVE

LOOK_EVERY_S: Final = 0.1


async def wait_for_change(
    questions: Questions,
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
    job, sha256 = await _read(questions, job_id)
    seen = etag_of_job(job) if known is None else known
    clock = asyncio.get_running_loop()
    until_s = clock.time() + wait_s
    while job.state in ACTIVE and matches(seen, etag_of_job(job)):
        left_s = until_s - clock.time()
        if left_s <= 0 or await is_disconnected():
            break
        await asyncio.sleep(min(LOOK_EVERY_S, left_s))
        # Only a number is read until it moves: many may wait at once.
        if await questions.versions.get(job_id) != job.version:
            job, sha256 = await _read(questions, job_id)
    return job, sha256


async def _read(questions: Questions, job_id: str) -> tuple[JobRow, str]:
    found = await questions.jobs.get(job_id)
    if found is None:
        raise no_such("job", job_id)
    return found

"""A job's changes: waited for without blocking a thread, and sent as events."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Response
from fastapi.responses import StreamingResponse
from sqlalchemy.exc import SQLAlchemyError

from service.access.callers import Caller
from service.api.conditional import matches
from service.api.deps import CallDep, found, own_job_only
from service.api.errors import problem_responses
from service.api.job_shapes import etag_of_job, shown
from service.api.questions import Questions
from service.db.failures import why_unavailable
from service.db.rows import JobRow
from service.wire.jobs import ACTIVE, FINAL

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])
log = logging.getLogger(__name__)

SIGN_OF_LIFE_S: Final = 10.0
_LOOK_AT_KEY_EVERY_S: Final = 2.0
_NOTHING_SEEN: Final = "0"
_LOOK_EVERY_S: Final = 0.1


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"text/event-stream": {}}, "description": "One `job` event per change."},
        204: {"description": "The job is final, `Last-Event-ID` its last event: do not reconnect."},
        **problem_responses(404),
    },
)
async def job_events(
    job_id: str,
    call: CallDep,
    last_event_id: Annotated[
        str, Header(alias="Last-Event-ID", description="Id of the last event that was seen.")
    ] = "",
) -> Response:
    """Send the job as it is, then at each change, until it is final.

    Each event's data is what `GET /v1/jobs/{id}` returns. With `Last-Event-ID` the first event
    is sent when the job differs from that event. The stream also ends if the database fails: ask
    again with `Last-Event-ID`. It ends for good when the key it was requested with becomes invalid.
    """
    job, _ = await wait_for_change(call.questions, job_id, None, 0.0, _never)
    seen = last_event_id or _NOTHING_SEEN
    if job.state in FINAL and seen == str(job.version):
        # After the end of a stream, browsers would otherwise ask for it again for ever.
        return Response(status_code=204)
    return StreamingResponse(
        _events(call.questions, _Listener(call.questions, call.caller), job_id, f'"{seen}"'),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-store"},
    )


async def _events(
    questions: Questions, listener: _Listener, job_id: str, seen: str
) -> AsyncIterator[str]:
    while True:
        try:
            job, sha256 = await wait_for_change(
                questions, job_id, seen, SIGN_OF_LIFE_S, listener.has_lost_its_key
            )
            if await listener.has_lost_its_key():
                return
        except SQLAlchemyError as error:
            why = why_unavailable(error)
            if why is None:
                raise
            # A client that asks again with Last-Event-ID misses nothing.
            log.warning("a stream of events ended early (%s)", why, extra={"job_id": job_id})
            return
        if etag_of_job(job) != seen:
            seen = etag_of_job(job)
            data = shown(job, sha256).model_dump_json()
            yield f"id: {job.version}\nevent: job\ndata: {data}\n\n"
        elif job.state in ACTIVE:
            yield ": nothing new\n\n"
        if job.state in FINAL:
            return


async def _never() -> bool:
    # The framework ends the stream of a client that has gone.
    return False


class _Listener:
    """The reader of a stream, and whether the key it was requested with is still valid."""

    def __init__(self, questions: Questions, caller: Caller):
        self._questions = questions
        self._key_id = caller.key_id
        self._next_s = time.monotonic() + _LOOK_AT_KEY_EVERY_S
        self._has_lost_its_key = False

    async def has_lost_its_key(self) -> bool:
        """Return whether the key is revoked or expired, checking every other second."""
        if self._key_id is not None and time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _LOOK_AT_KEY_EVERY_S
            self._has_lost_its_key = bool(await self._questions.ended_keys.get(self._key_id))
        return self._has_lost_its_key


async def wait_for_change(
    questions: Questions,
    job_id: str,
    known: str | None,
    wait_s: float,
    is_disconnected: Callable[[], Awaitable[bool]],
) -> tuple[JobRow, str]:
    """Return a job and its scenario's hash when it changes, at the latest after ``wait_s``.

    Parameters
    ----------
    known
        The client's ``If-None-Match``, the state it has seen; None for the present state.

    Raises
    ------
    ServiceError
        If there is no such job.
    """
    job, sha256 = await _read(questions, job_id)
    seen = etag_of_job(job) if known is None else known
    clock = asyncio.get_running_loop()
    until_s = clock.time() + wait_s
    while job.state in ACTIVE and matches(seen, etag_of_job(job)):
        left_s = until_s - clock.time()
        if left_s <= 0 or await is_disconnected():
            break
        await asyncio.sleep(min(_LOOK_EVERY_S, left_s))
        # Only the version is read until it changes, as many clients may wait at once.
        if await questions.versions.get(job_id) != job.version:
            job, sha256 = await _read(questions, job_id)
    return job, sha256


async def _read(questions: Questions, job_id: str) -> tuple[JobRow, str]:
    return found(await questions.jobs.get(job_id), "job", job_id)

"""A job's changes as server-sent events."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Response
from fastapi.responses import StreamingResponse
from sqlalchemy.exc import SQLAlchemyError

from service.api.deps import DatabaseDep, own_job_only
from service.api.errors import problem_responses
from service.api.job_shapes import etag_of_job, shown
from service.api.job_wait import Versions, VersionsDep, wait_for_change
from service.db.failures import why_unavailable
from service.db.session import Database
from service.wire.jobs import ACTIVE, FINAL

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])
log = logging.getLogger(__name__)

SIGN_OF_LIFE_S: Final = 10.0
_NOTHING_SEEN: Final = "0"


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"text/event-stream": {}}, "description": "One `job` event a change."},
        204: {"description": "The job is final and `Last-Event-ID` is its end: do not reconnect."},
        **problem_responses(404),
    },
)
async def job_events(
    job_id: str,
    database: DatabaseDep,
    versions: VersionsDep,
    last_event_id: Annotated[
        str, Header(alias="Last-Event-ID", description="The last event that was seen.")
    ] = "",
) -> Response:
    """Send the job as it is, then at each change, until it is final.

    Each event's data is what `GET /v1/jobs/{id}` answers. With `Last-Event-ID` the first
    event comes when the job is no longer what that event told. The stream also ends where the
    database fails: ask again with `Last-Event-ID`.
    """
    job, _ = await wait_for_change(database, versions, job_id, None, 0.0, _never)
    seen = last_event_id or _NOTHING_SEEN
    if job.state in FINAL and seen == str(job.version):
        # What browsers do after a stream has ended is to ask for it again, for ever.
        return Response(status_code=204)
    return StreamingResponse(
        _events(database, versions, job_id, f'"{seen}"'),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-store"},
    )


async def _events(
    database: Database, versions: Versions, job_id: str, seen: str
) -> AsyncIterator[str]:
    while True:
        try:
            job, sha256 = await wait_for_change(
                database, versions, job_id, seen, SIGN_OF_LIFE_S, _never
            )
        except SQLAlchemyError as error:
            why = why_unavailable(error)
            if why is None:
                raise
            # Who asks again with Last-Event-ID misses nothing.
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

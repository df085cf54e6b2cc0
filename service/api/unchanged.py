"""Polls of what has not changed, answered before all else: dashboards ask little else."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.routing import compile_path
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import Caller
from service.api import ask_again
from service.api.job_shapes import etag_of_timeline, etag_of_version
from service.api.shapes import matches
from service.db.rows import JobResultRow, JobRow
from service.db.session import Database

_THREADS: Final = 4
_JSON: Final = (None, "*/*", "application/json")
_IS_THE_JOB: Final = JobRow.id == sa.bindparam("job_id")


@dataclass(frozen=True, slots=True)
class _Polled:
    """Something of a job that clients ask for again and again.

    Attributes
    ----------
    path_format
        Of its route, which metrics ask for.
    query
        The job's owner, and what ``headers_of`` needs. Made once: to make and compile it takes
        longer than to run it.
    headers_of
        The headers of an answer, ``ETag`` among them.
    """

    path_format: str
    query: sa.Select[*tuple[Any, ...]]
    headers_of: Callable[[sa.Row[Any]], dict[str, str]]


def _headers_of_job(row: sa.Row[Any]) -> dict[str, str]:
    headers = {"ETag": etag_of_version(row.version)}
    seconds = ask_again.seconds_until(row.state, row.created_at)
    return headers if seconds is None else headers | {"Retry-After": str(seconds)}


def _headers_of_timeline(row: sa.Row[Any]) -> dict[str, str]:
    return {"ETag": etag_of_timeline(row.job_id), "Vary": "Accept"}


_JOB: Final = _Polled(
    path_format="/v1/jobs/{job_id}",
    query=sa.select(JobRow.tenant, JobRow.version, JobRow.state, JobRow.created_at).where(
        _IS_THE_JOB
    ),
    headers_of=_headers_of_job,
)
_TIMELINE: Final = _Polled(
    path_format="/v1/jobs/{job_id}/timeline",
    query=sa.select(JobRow.tenant, JobResultRow.job_id)
    .join(JobRow, JobRow.id == JobResultRow.job_id)
    .where(_IS_THE_JOB),
    headers_of=_headers_of_timeline,
)
_POLLED: Final = [(compile_path(polled.path_format)[0], polled) for polled in (_JOB, _TIMELINE)]


class UnchangedJobs:
    """Answer 304 to polls of a job or of its timeline where ``If-None-Match`` names what there is.

    The routes would answer the same, after finding out what only a whole answer needs: this takes
    a fraction of it. Everything else is left to them, refusals and other forms included.
    """

    def __init__(self, app: ASGIApp):
        self.app = app
        # The loop's own executor costs less than Starlette's, which can be cancelled.
        self._threads = ThreadPoolExecutor(_THREADS, "unchanged")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        answer = await self._unchanged(scope)
        await (answer or self.app)(scope, receive, send)

    async def _unchanged(self, scope: Scope) -> Response | None:
        if scope["type"] != "http" or scope["method"] != "GET" or scope["query_string"]:
            return None
        headers = Headers(scope=scope)
        known = headers.get("if-none-match")
        polled, job_id = _polled(scope["path"])
        # The other forms of a timeline have other names.
        if known is None or polled is None or headers.get("accept") not in _JSON:
            return None
        database = cast(Database, scope["app"].state.database)
        try:
            row = await asyncio.get_running_loop().run_in_executor(
                self._threads, _row, database, polled.query, job_id
            )
        except SQLAlchemyError:
            return None
        caller = cast(Caller, scope["state"]["caller"])
        if row is None or caller.visible_owner not in (None, row.tenant):
            return None
        answer = polled.headers_of(row)
        if not matches(known, answer["ETag"]):
            return None
        scope["route"] = polled
        return Response(status_code=304, headers=answer)


def _polled(path: str) -> tuple[_Polled | None, str]:
    for pattern, polled in _POLLED:
        if job := pattern.match(path):
            return polled, job["job_id"]
    return None, ""


def _row(database: Database, query: sa.Select[*tuple[Any, ...]], job_id: str) -> sa.Row[Any] | None:
    with database.asking() as connection:
        return connection.execute(query, {"job_id": job_id}).one_or_none()

"""Polls of a job that has not changed, answered before all else: dashboards ask little else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, cast

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.routing import compile_path
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import Caller
from service.api.job_shapes import etag_of_version
from service.api.shapes import matches
from service.db.rows import JobRow
from service.db.session import Database

_JOB, _TEMPLATE, _ = compile_path("/v1/jobs/{job_id}")
# Made once: to make and compile it takes longer than to run it.
_NEWEST: Final = sa.select(JobRow.version, JobRow.tenant).where(JobRow.id == sa.bindparam("job_id"))


@dataclass(frozen=True, slots=True)
class _Route:
    """What metrics ask of the route that a call has taken."""

    path_format: str


class UnchangedJobs:
    """Answer 304 to ``GET /v1/jobs/{id}`` where ``If-None-Match`` names what there is.

    The route would answer the same, after finding out what only a whole answer needs: this takes
    a fraction of it. Everything else is left to the route, refusals included.
    """

    def __init__(self, app: ASGIApp):
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        etag = await self._unchanged(scope)
        if etag is None:
            await self.app(scope, receive, send)
            return
        scope["route"] = _Route(_TEMPLATE)
        await Response(status_code=304, headers={"ETag": etag})(scope, receive, send)

    async def _unchanged(self, scope: Scope) -> str | None:
        if scope["type"] != "http" or scope["method"] != "GET" or scope["query_string"]:
            return None
        job = _JOB.match(scope["path"])
        known = Headers(scope=scope).get("if-none-match") if job else None
        if job is None or known is None:
            return None
        database = cast(Database, scope["app"].state.database)
        try:
            found = await run_in_threadpool(_newest, database, job["job_id"])
        except SQLAlchemyError:
            found = None
        if found is None:
            return None
        version, owner = found
        etag = etag_of_version(version)
        caller = cast(Caller, scope["state"]["caller"])
        is_visible = caller.visible_owner in (None, owner)
        return etag if is_visible and matches(known, etag) else None


def _newest(database: Database, job_id: str) -> tuple[int, str] | None:
    with database.asking() as connection:
        row = connection.execute(_NEWEST, {"job_id": job_id}).one_or_none()
        return None if row is None else (row.version, row.tenant)

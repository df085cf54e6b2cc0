"""Polls of jobs and of timelines, answered before all else: dashboards ask little else."""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers, State
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import Caller
from service.api.job_shapes import etag_of_timeline, headers_of, shown
from service.api.shapes import matches
from service.api.together import Together
from service.db.rows import JobResultRow, JobRow, ScenarioRow
from service.db.session import Database

_JSON: Final = "application/json"
_ACCEPTABLE: Final = (None, "*/*", _JSON)
# Made once: to make and compile a query takes longer than to run it.
_THESE: Final = JobRow.id.in_(sa.bindparam("ids", expanding=True))
_JOBS: Final = sa.select(
    JobRow.id, JobRow.tenant, JobRow.version, JobRow.state, JobRow.created_at
).where(_THESE)
_WHOLE_JOBS: Final = (
    sa.select(JobRow, ScenarioRow.sha256)
    .join(ScenarioRow, ScenarioRow.id == JobRow.scenario_id)
    .where(_THESE)
)
_TIMELINES: Final = (
    sa.select(JobRow.id, JobRow.tenant)
    .join(JobResultRow, JobRow.id == JobResultRow.job_id)
    .where(_THESE)
)

_MOST_KEPT: Final = 200
_LONGEST_KEPT: Final = 20_000


class Polls:
    """Answer ``GET`` of a job, and 304 where a client has a job's timeline already.

    The routes would answer the same, each call for itself and after finding out what only other
    calls need. Here polls that come at about the same time share one query. Everything else is
    left to the routes: refusals, other forms, a database that fails.

    Parameters
    ----------
    state
        The application's, whose ``database`` is asked.
    """

    def __init__(self, app: ASGIApp, state: State):
        self.app = app
        jobs = _PolledJobs(state)
        timelines = _PolledTimelines(state)
        self._polled = [_Polled("", jobs.answer), _Polled("/timeline", timelines.answer)]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        answer = await self._answer(scope)
        await (answer or self.app)(scope, receive, send)

    async def _answer(self, scope: Scope) -> Response | None:
        if scope["type"] != "http" or scope["method"] != "GET" or scope["query_string"]:
            return None
        for polled in self._polled:
            if found := polled.path.fullmatch(scope["path"]):
                break
        else:
            return None
        headers = Headers(scope=scope)
        # The other forms of a timeline have other names.
        if headers.get("accept") not in _ACCEPTABLE:
            return None
        caller = cast(Caller, scope["state"]["caller"])
        try:
            answer = await polled.answer(found[1], caller, headers.get("if-none-match"))
        except SQLAlchemyError:
            return None
        if answer is not None:
            scope["route"] = polled
        return answer


class _Polled:
    """A path that clients ask for again and again.

    ``path_format`` is that of its route, which metrics ask for. Ids are told by their form, as
    one that the database cannot even read would spoil the query of the others.
    """

    def __init__(
        self,
        end: str,
        answer: Callable[[str, Caller, str | None], Awaitable[Response | None]],
    ):
        self.path_format = "/v1/jobs/{job_id}" + end
        self.path = re.compile(f"/v1/jobs/([0-9a-f-]{{36}}){end}")
        self.answer = answer


class _PolledJobs:
    """Jobs, whose whole answers are kept for the others who follow the same job."""

    def __init__(self, state: State):
        self._state = state
        self._rows = Together(self._find)
        self._whole = Together(self._write)
        self._kept: OrderedDict[tuple[str, int], bytes] = OrderedDict()

    async def answer(self, job_id: str, caller: Caller, known: str | None) -> Response | None:
        row = await self._rows.get(job_id)
        if row is None or not _may_see(caller, row):
            return None
        if matches(known, headers_of(row)["ETag"]):
            return Response(status_code=304, headers=headers_of(row))
        body = self._kept.get((row.id, row.version))
        if body is None:
            whole = await self._whole.get(job_id)
            if whole is None:
                return None
            row, body = whole
            self._keep((row.id, row.version), body)
        return Response(body, media_type=_JSON, headers=headers_of(row))

    def _find(self, job_ids: Sequence[str]) -> Mapping[str, sa.Row[Any]]:
        return _rows(self._state.database, _JOBS, job_ids)

    def _write(self, job_ids: Sequence[str]) -> Mapping[str, tuple[JobRow, bytes]]:
        database = cast(Database, self._state.database)
        with database.reading() as session:
            found = session.execute(_WHOLE_JOBS, {"ids": job_ids}).all()
        return {job.id: (job, shown(job, sha).model_dump_json().encode()) for job, sha in found}

    def _keep(self, name: tuple[str, int], body: bytes) -> None:
        if len(body) > _LONGEST_KEPT:
            return
        self._kept[name] = body
        if len(self._kept) > _MOST_KEPT:
            self._kept.popitem(last=False)


class _PolledTimelines:
    """Timelines, which never change: who has one is told so."""

    def __init__(self, state: State):
        self._state = state
        self._rows = Together(self._find)

    async def answer(self, job_id: str, caller: Caller, known: str | None) -> Response | None:
        etag = etag_of_timeline(job_id)
        if not matches(known, etag):
            return None
        row = await self._rows.get(job_id)
        if row is None or not _may_see(caller, row):
            return None
        return Response(status_code=304, headers={"ETag": etag, "Vary": "Accept"})

    def _find(self, job_ids: Sequence[str]) -> Mapping[str, sa.Row[Any]]:
        return _rows(self._state.database, _TIMELINES, job_ids)


def _rows(
    database: Database, query: sa.Select[*tuple[Any, ...]], job_ids: Sequence[str]
) -> Mapping[str, sa.Row[Any]]:
    with database.asking() as connection:
        return {row.id: row for row in connection.execute(query, {"ids": job_ids})}


def _may_see(caller: Caller, row: sa.Row[Any]) -> bool:
    return caller.visible_owner in (None, row.tenant)

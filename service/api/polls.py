"""Polls of jobs and timelines, the most frequent requests, answered before the routes."""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers, State
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import Caller
from service.api.batched import BatchedQueries
from service.api.conditional import matches
from service.api.job_shapes import etag_of_job, etag_of_timeline, headers_of, shown
from service.db.rows import JobResultRow, JobRow
from service.db.session import Database
from service.stores import job_store

# Only well-formed ids: a malformed one would make the query fail for all others.
_PATH: Final = re.compile(r"/v1/jobs/([0-9a-f-]{36})(/timeline)?")
_JSON: Final = "application/json"
_ACCEPTABLE: Final = (None, "*/*", _JSON)
# Made once: making and compiling a query takes longer than running it.
_THESE: Final = JobRow.id.in_(sa.bindparam("ids", expanding=True))
_JOBS: Final = sa.select(
    JobRow.id, JobRow.tenant, JobRow.version, JobRow.state, JobRow.created_at
).where(_THESE)
_TIMELINES: Final = (
    sa.select(JobRow.id, JobRow.tenant)
    .join(JobResultRow, JobRow.id == JobResultRow.job_id)
    .where(_THESE)
)

_MOST_KEPT: Final = 200
_LONGEST_KEPT: Final = 20_000

Poll = tuple[str, str | None]
"""A job's id and the poll's ``If-None-Match``."""


class Polls:
    """Answer ``GET`` of a job, and 304 if a client has a job's timeline already.

    The routes would give the same answers, but each call by itself and after work that only other
    calls need. Here polls that arrive at about the same time share one query, and clients that
    follow the same job share its answer. Everything else is left to the routes: refusals, other
    forms, failures of the database.

    Parameters
    ----------
    state
        The state of the application, with its ``database``.
    """

    def __init__(self, app: ASGIApp, state: State):
        self.app = app
        self._polled = {
            None: _Polled("", _PolledJobs(state).ask),
            "/timeline": _Polled("/timeline", partial(_known_timelines, state), needs_etag=True),
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        answer = await self._answer(scope)
        await (answer or self.app)(scope, receive, send)

    async def _answer(self, scope: Scope) -> Response | None:
        if scope["type"] != "http" or scope["method"] != "GET" or scope["query_string"]:
            return None
        path, headers = _PATH.fullmatch(scope["path"]), Headers(scope=scope)
        # Other forms of a timeline have other paths and ETags.
        if path is None or headers.get("accept") not in _ACCEPTABLE:
            return None
        job_id, end = path.groups()
        polled, known = self._polled[end], headers.get("if-none-match")
        if known is None and polled.needs_etag:
            return None
        try:
            found = await polled.answers.get((job_id, known))
        except SQLAlchemyError:
            return None
        caller = cast(Caller, scope["state"]["caller"])
        if found is None or caller.visible_owner not in (None, found.owner):
            return None
        scope["route"] = polled
        return found.response()


@dataclass(frozen=True, slots=True)
class _Found:
    """The answer to a poll, without a ``body`` if the client has it."""

    owner: str
    headers: dict[str, str]
    body: bytes | None = None

    def response(self) -> Response:
        if self.body is None:
            return Response(status_code=304, headers=self.headers)
        return Response(self.body, media_type=_JSON, headers=self.headers)


class _Polled:
    """A kind of resource that clients poll.

    ``path_format`` is that of its route, for metrics.
    """

    def __init__(
        self,
        end: str,
        ask: Callable[[Sequence[Poll]], Mapping[Poll, _Found]],
        *,
        needs_etag: bool = False,
    ):
        self.needs_etag = needs_etag
        self.path_format = "/v1/jobs/{job_id}" + end
        self.answers = BatchedQueries(ask)


class _PolledJobs:
    """Answers to polls of jobs; the last full one of each is kept for the job's other clients."""

    def __init__(self, state: State):
        self._state = state
        self._kept: OrderedDict[str, tuple[int, bytes]] = OrderedDict()

    def ask(self, polls: Sequence[Poll]) -> Mapping[Poll, _Found]:
        database = cast(Database, self._state.database)
        rows = _rows(database, _JOBS, polls)
        found = {
            (job_id, known): _Found(row.tenant, headers_of(row))
            for job_id, known in polls
            if (row := rows.get(job_id)) is not None and matches(known, etag_of_job(row))
        }
        changed = [poll for poll in polls if poll[0] in rows and poll not in found]
        whole = self._whole(database, {job_id: rows[job_id] for job_id, _ in changed})
        return found | {poll: whole[poll[0]] for poll in changed if poll[0] in whole}

    def _whole(self, database: Database, rows: Mapping[str, sa.Row[Any]]) -> Mapping[str, _Found]:
        whole: dict[str, _Found] = {}
        for row in rows.values():
            version, body = self._kept.get(row.id, (None, b""))
            if version == row.version:
                whole[row.id] = _Found(row.tenant, headers_of(row), body)
        missing = rows.keys() - whole.keys()
        if missing:
            with database.reading() as session:
                jobs = job_store.with_hashes(session, missing)
            for job, sha256 in jobs.values():
                body = shown(job, sha256).model_dump_json().encode()
                whole[job.id] = _Found(job.tenant, headers_of(job), body)
                self._keep(job, body)
        return whole

    def _keep(self, job: JobRow, body: bytes) -> None:
        self._kept.pop(job.id, None)
        if len(body) <= _LONGEST_KEPT:
            self._kept[job.id] = job.version, body
        if len(self._kept) > _MOST_KEPT:
            self._kept.popitem(last=False)


def _known_timelines(state: State, polls: Sequence[Poll]) -> Mapping[Poll, _Found]:
    """Return which timelines the clients have already: timelines never change."""
    known = [poll for poll in polls if matches(poll[1], etag_of_timeline(poll[0]))]
    rows = _rows(cast(Database, state.database), _TIMELINES, known) if known else {}
    return {
        poll: _Found(rows[poll[0]].tenant, {"ETag": etag_of_timeline(poll[0]), "Vary": "Accept"})
        for poll in known
        if poll[0] in rows
    }


def _rows(
    database: Database, query: sa.Select[*tuple[Any, ...]], polls: Sequence[Poll]
) -> Mapping[str, sa.Row[Any]]:
    """Return the rows of the polled jobs, by id."""
    job_ids = list({job_id for job_id, _ in polls})
    with database.asking_untested() as connection:
        return {row.id: row for row in connection.execute(query, {"ids": job_ids})}

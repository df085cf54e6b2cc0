"""Dependencies of routes on the application, and checks of every call."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Final, TypeVar

from fastapi import Depends, Request, Response
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.access.audit import Audit
from service.access.callers import Caller, Scope
from service.api.guard import require_scope
from service.api.questions import Questions
from service.db.columns import Owned
from service.db.session import Database
from service.files.told import media_type_told
from service.problems.faults import require_none
from service.problems.kinds import ServiceError
from service.settings import Settings
from service.stores import usage_store
from service.stores.finding import find_own, no_such
from service.wire.base import is_plain

T = TypeVar("T")
W = TypeVar("W", bound=Owned)

ANY_FILE: Final = "application/octet-stream"
"""A file of any form that a call accepts. Generated clients can often send nothing else."""

# What needs no thread is async: FastAPI runs everything else in one, which costs more than the
# work itself.


async def _raw_body(request: Request) -> bytes:
    return await request.body()


RawBodyDep = Annotated[bytes, Depends(_raw_body)]


@dataclass(frozen=True, slots=True)
class Call:
    """A request under way: its caller, the application's parts, and the headers of its answer."""

    request: Request
    response: Response
    caller: Caller
    database: Database
    settings: Settings
    questions: Questions
    audit: Audit

    def count_stored(self, session: Session, *, num_rows: int = 0, num_bytes: int = 0) -> None:
        """Count what is stored for the caller; 403 ``quota_exceeded`` if it is too much."""
        owner, settings = self.caller.owner, self.settings
        usage = usage_store.used(session, owner)
        if num_rows or num_bytes:
            usage = usage_store.add(session, owner, num_rows=num_rows, num_bytes=num_bytes)
        usage_store.require(usage, settings.max_rows_per_tenant, settings.max_stored_mb_per_tenant)

    @contextmanager
    def noted(self, action: str, kind: str, own_id: str) -> Iterator[Session]:
        """Yield a session that may write; its transaction also records an audit event."""
        with self.database.transaction() as session:
            yield session
            self.audit.record(session, action, kind, own_id)

    def own(
        self, session: Session, table: type[W], what: str, own_id: str, *, to_change: bool = False
    ) -> W:
        """Return a row that the caller may see; 404, naming ``what`` it is, if there is none."""
        row = find_own(session, table, own_id, self.caller.visible_owner, to_change=to_change)
        return found(row, what, own_id)


def found(thing: T | None, what: str, own_id: str) -> T:
    """Return ``thing``; 404, naming ``what`` it is, if it is None."""
    if thing is None:
        raise no_such(what, own_id)
    return thing


async def _call(request: Request, response: Response) -> Call:
    caller, state = request.state.caller, request.app.state
    audit = Audit(caller=caller, request_id=request.state.request_id)
    return Call(request, response, caller, state.database, state.settings, state.questions, audit)


CallDep = Annotated[Call, Depends(_call)]


async def admin_only(call: CallDep) -> None:
    """Refuse callers without the scope `admin`."""
    require_scope(call.caller, Scope.ADMIN)


async def own_job_only(call: CallDep) -> None:
    """Let a caller reach only its own jobs: for others, answer 404."""
    job_id = call.request.path_params.get("job_id")
    owner = call.caller.visible_owner
    if job_id is None or owner is None:
        return
    if await call.questions.owners.get(job_id) != owner:
        raise no_such("job", job_id)


def require_media_type(request: Request, *allowed: str) -> str:
    """Return the media type of the body; 415 if it is none of these."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type not in allowed:
        said = media_type or "missing"
        raise ServiceError(
            "unsupported_media_type",
            f"Content-Type is {said}; this call accepts {', '.join(allowed)}.",
            headers={"Accept-Post": ", ".join(allowed)},
        )
    return media_type


def file_type(request: Request, data: bytes, *allowed: str) -> str:
    """Return a file's media type, detected if sent as ``ANY_FILE``; 415 if it is none of these."""
    kind = require_media_type(request, *allowed, ANY_FILE)
    return media_type_told(data, allowed) if kind == ANY_FILE else kind


async def check_request(request: Request) -> None:
    """Refuse query parameters that the call does not have, and JSON bodies sent as another type."""
    route = request.scope.get("route")
    if not isinstance(route, APIRoute):
        return
    known = set(_query_names(route.dependant))
    faults = [
        Fault(code="unknown_parameter", detail=f"There is no query parameter {name!r}.")
        for name in request.query_params
        if name not in known
    ]
    given = Counter(name for name, _ in request.query_params.multi_items())
    faults += [
        Fault(code="invalid_value", detail=f"The query parameter {name!r} is given {times} times.")
        for name, times in given.items()
        if times > 1
    ]
    if not all(map(is_plain, (request.scope["path"], *request.query_params.values()))):
        detail = "A path or parameter contains characters that are not allowed."
        faults.append(Fault(code="invalid_value", detail=detail))
    require_none(faults)
    if route.body_field is not None and await request.body():
        require_media_type(request, "application/json")


def _query_names(dependant: Dependant) -> Iterator[str]:
    for field in dependant.query_params:
        yield field.alias
    for part in dependant.dependencies:
        yield from _query_names(part)

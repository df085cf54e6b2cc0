"""Passes of a plan's satellites over its stations, and the data that they downlink."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Path, Query, Response
from fastapi.responses import StreamingResponse

from planner_core.domain import GroundStation
from service.answers.passes import PassFilter, passes_of_plan
from service.api import job_intake as intake
from service.api.accept import require_offered
from service.api.deps import Call, CallDep
from service.api.errors import problem_responses
from service.api.paging import PagingDep
from service.api.plans import find_plan
from service.db.rows import JobRow
from service.exports.passes import write_csv, write_ics
from service.scenarios.stored_question import StoredQuestion
from service.stores import job_store
from service.wire.base import Instant, Listed, read
from service.wire.passes import PassOut
from service.wire.timelines import TimelineOut

router = APIRouter(prefix="/v1/plans", tags=["plans"])

_TYPES: Final = {"csv": "text/csv", "ics": "text/calendar"}

Suffix = Annotated[
    str, Path(description="`csv`: a table; `ics`: a calendar.", examples=list(_TYPES))
]


def _filter(
    station_id: Annotated[str | None, Query(description="Only of this station.")] = None,
    satellite_id: Annotated[str | None, Query(description="Only of this satellite.")] = None,
    from_: Annotated[
        Instant | None, Query(alias="from", description="Only passes that end after this.")
    ] = None,
    to: Annotated[Instant | None, Query(description="Only passes that begin before this.")] = None,
    planned: Annotated[
        bool | None, Query(description="Only passes with a contact, or only those without.")
    ] = None,
) -> PassFilter:
    return PassFilter(
        station_id=station_id, satellite_id=satellite_id, start=from_, end=to, planned=planned
    )


FilterDep = Annotated[PassFilter, Depends(_filter)]


@router.get("/{plan_id}/passes", responses=problem_responses(404, 409, 503))
def list_passes(
    plan_id: str, call: CallDep, paging: PagingDep, wanted: FilterDep
) -> Listed[PassOut]:
    """List the passes of a plan's satellites over its stations in order of AOS, planned or not."""
    after = paging.after_number()
    numbered = list(enumerate(_find(call, plan_id, wanted)[0]))[after + 1 :]
    page = paging.answer(numbered[: paging.limit + 1], lambda pair: pair[0])
    return page.listed(lambda pair: pair[1])


@router.get(
    "/{plan_id}/passes.{suffix}",
    response_class=Response,
    responses={
        200: {
            "description": "The passes.",
            "content": {media_type: {} for media_type in _TYPES.values()},
        },
        **problem_responses(404, 406, 409, 503),
    },
)
def get_passes_as(plan_id: str, suffix: Suffix, call: CallDep, wanted: FilterDep) -> Response:
    """Return the passes of a plan as a table or as a calendar."""
    with call.database.reading() as session:
        find_plan(session, plan_id, call)
    require_offered(suffix, _TYPES, "Passes are")
    passes, stations, made_at = _find(call, plan_id, wanted)
    return StreamingResponse(
        write_csv(passes) if suffix == "csv" else write_ics(passes, stations, made_at),
        media_type=_TYPES[suffix],
        headers={"Content-Disposition": f'inline; filename="passes-{plan_id}.{suffix}"'},
    )


def _find(
    call: Call, plan_id: str, wanted: PassFilter
) -> tuple[Sequence[PassOut], dict[str, GroundStation], datetime]:
    """Return the passes, the stations by id, and when the plan was made."""
    with call.database.reading() as session:
        job = session.get_one(JobRow, find_plan(session, plan_id, call).job_id)
        made_at = intake.require_answer(session, job)
        timeline = read(TimelineOut, intake.find_timeline(session, job))
        question = StoredQuestion(job_store.content_of(session, job.id))
    stations = {station.id: station for station in question.ground_stations}
    return passes_of_plan(question, timeline, wanted), stations, made_at

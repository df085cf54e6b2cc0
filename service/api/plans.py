"""The life cycle of plans: taken from a job, approved, published, and reported on."""

from __future__ import annotations

from datetime import datetime
from functools import partial
from typing import Annotated, cast

from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from service.access.callers import Scope
from service.api import job_intake as intake
from service.api.conditional import etagged, matched, readable, unless_known
from service.api.deps import Call, CallDep
from service.api.errors import problem_responses
from service.api.guard import require_scope
from service.api.idempotency import OnceDep
from service.api.paging import PagingDep, newest_first
from service.api.timelines import Suffix, timeline_answer, timeline_responses
from service.db import clock
from service.db.rows import JobRow, PlanActionRow, PlanRow, PlanSatelliteRow
from service.exports.forms import FORMS
from service.plans import lifecycle
from service.plans import store as plan_store
from service.problems.faults import refuse_one
from service.stores import deletion, job_store
from service.webhooks import outbox
from service.wire.base import Listed, parse_instant, read
from service.wire.plans import (
    TRANSITIONS,
    PlanActionOut,
    PlanEventOut,
    PlanIn,
    PlanOut,
    PlanSatelliteOut,
    PlanState,
    TransitionIn,
)
from service.wire.scenarios import HorizonOut
from service.wire.stored import from_row
from service.wire.timelines import TimelineOut

router = APIRouter(prefix="/v1/plans", tags=["plans"])


@router.post("", status_code=201, responses=problem_responses(409, 422))
def create_plan(body: PlanIn, call: CallDep, once: OnceDep) -> PlanOut:
    """Take the plan of a job into operations, as a draft."""
    with once.transaction() as session:
        owner = job_store.owner_of(session, body.job_id)
        if owner is None or call.caller.visible_owner not in (None, owner):
            detail = f"There is no job {body.job_id!r}."
            raise refuse_one("unknown_job", detail, "/job_id")
        job = intake.find_job(session, body.job_id)
        timeline = read(TimelineOut, intake.find_timeline(session, job))
        plan = plan_store.add(session, call.caller, owner, job.id, body.name, timeline)
        outbox.tell_plan(session, plan, None, None)
        return once.created(session, "plan", plan.id, _shown(session, plan))


@router.get("")
def list_plans(
    call: CallDep,
    paging: PagingDep,
    state: Annotated[PlanState | None, Query(description="Only plans in this state.")] = None,
    satellite_id: Annotated[str | None, Query(description="Only plans of this satellite.")] = None,
    at: Annotated[
        str | None,
        Query(description="Only plans in force at this instant; `now` for the present one."),
    ] = None,
    job_id: Annotated[str | None, Query(description="Only plans of this job.")] = None,
    parent_id: Annotated[str | None, Query(description="Only replans of this plan.")] = None,
) -> Listed[PlanOut]:
    """List plans, newest first.

    `state=published&at=now` is the stable link to the plans in force. With an instant, plans that
    were in force then are listed even if they have been superseded since.
    """
    with call.database.reading() as session:
        query = plan_store.matching(
            owner=call.caller.visible_owner, state=state, satellite_id=satellite_id,
            at=_instant(session, at), job_id=job_id, parent_id=parent_id,
        )  # fmt: skip
        page = newest_first(session, query, PlanRow.id, paging)
        satellites = plan_store.satellites(session, [plan.id for plan in page.rows])
    items = [_plan_out(plan, satellites[plan.id]) for plan in page.rows]
    return Listed(items=items, next=page.next)


def _instant(session: Session, at: str | None) -> datetime | None:
    if at is None:
        return None
    if at == "now":
        return clock.now(session)
    try:
        return parse_instant(at)
    except ValueError as error:
        raise refuse_one("invalid_time", f"at: {error}.") from None


@router.get("/{plan_id}", response_model=PlanOut, responses=readable())
def get_plan(plan_id: str, call: CallDep) -> PlanOut | Response:
    """Return one plan."""
    with call.database.reading() as session:
        return unless_known(call, _shown(session, find_plan(session, plan_id, call)))


@router.delete("/{plan_id}", status_code=204, responses=problem_responses(404, 409, 412))
def delete_plan(plan_id: str, call: CallDep) -> None:
    """Delete a plan permanently, unless it is approved or published or has replans."""
    with call.noted("delete", "plan", plan_id) as session:
        plan = find_plan(session, plan_id, call, to_change=True)
        matched(call, plan, partial(_shown, session))
        deletion.delete_plan(session, plan)


@router.post("/{plan_id}/transitions", responses=problem_responses(403, 404, 409, 412, 422))
def move_plan(plan_id: str, body: TransitionIn, call: CallDep, once: OnceDep) -> PlanOut:
    """Approve, publish or withdraw a plan.

    Publishing supersedes the plans in force for its satellites from `effective_from` on. It is
    refused (409) if another plan was published there since this one was approved, unless this one
    is a replan of it. Approval needs the scope `approve`, and waivers for all violations.
    """
    if body.to == "approved":
        require_scope(call.caller, Scope.APPROVE)
    with once.transaction() as session:
        if body.to == "published":
            # Before the plan itself is locked, so that two publications run one after the other.
            plan_store.lock_publishing(session, find_plan(session, plan_id, call).owner)
        plan = find_plan(session, plan_id, call, to_change=True)
        matched(call, plan, partial(_shown, session))
        lifecycle.move(session, call.caller, plan, body)
        call.audit.record(session, body.to, "plan", plan.id)
        shown = _shown(session, plan)
        call.response.headers["ETag"] = etagged(shown)
        return once.keep(session, shown)


@router.get("/{plan_id}/history", responses=problem_responses(404))
def list_history(plan_id: str, call: CallDep) -> Listed[PlanEventOut]:
    """List a plan's transitions in their order: who, when and why."""
    with call.database.reading() as session:
        find_plan(session, plan_id, call)
        events = plan_store.history(session, plan_id)
    return Listed(items=[from_row(PlanEventOut, event) for event in events], next=None)


@router.get("/{plan_id}/actions", responses=problem_responses(404))
def list_actions(
    plan_id: str,
    call: CallDep,
    paging: PagingDep,
    satellite_id: Annotated[str | None, Query(description="Only of this satellite.")] = None,
) -> Listed[PlanActionOut]:
    """List a plan's collects and contacts, with their outcomes if reported."""
    with call.database.reading() as session:
        find_plan(session, plan_id, call)
        found = plan_store.actions(
            session, plan_id, paging.after_number(), paging.limit + 1, satellite_id
        )
    page = paging.answer(found, lambda pair: pair[0].position)
    return page.listed(lambda pair: action_out(*pair))


@router.get(
    "/{plan_id}/timeline.{suffix}", response_class=Response, responses=timeline_responses(FORMS)
)
def get_plan_as(plan_id: str, suffix: Suffix, call: CallDep) -> Response:
    """Return the timeline of the plan's job in the form that the suffix names."""
    with call.database.reading() as session:
        job = session.get_one(JobRow, find_plan(session, plan_id, call).job_id)
    return timeline_answer(call, job, suffix)


def find_plan(session: Session, plan_id: str, call: Call, *, to_change: bool = False) -> PlanRow:
    """Return a plan; 404 if there is none that the caller may see."""
    return call.own(session, PlanRow, "plan", plan_id, to_change=to_change)


def _shown(session: Session, plan: PlanRow) -> PlanOut:
    return _plan_out(plan, plan_store.satellites(session, [plan.id])[plan.id])


def _plan_out(plan: PlanRow, satellites: list[PlanSatelliteRow]) -> PlanOut:
    address = f"/v1/plans/{plan.id}"
    parts = ("actions", "history", "executions", "states")
    links = {
        "self": address,
        **{part: f"{address}/{part}" for part in parts},
        "timeline": f"{address}/timeline.json",
        "passes": f"{address}/passes",
        "job": f"/v1/jobs/{plan.job_id}",
    }
    if plan.parent_id is not None:
        links["parent"] = f"/v1/plans/{plan.parent_id}"
        links["changes"] = f"{address}/changes"
    return from_row(
        PlanOut,
        plan,
        horizon=HorizonOut(start=plan.horizon_start, end=plan.horizon_end),
        satellites=[from_row(PlanSatelliteOut, row) for row in satellites],
        allowed=TRANSITIONS[cast(PlanState, plan.state)],
        links=links,
    )


def action_out(row: PlanActionRow, outcome: str | None) -> PlanActionOut:
    """Return an action with its outcome."""
    return from_row(PlanActionOut, row, id=row.action_id, outcome=outcome)

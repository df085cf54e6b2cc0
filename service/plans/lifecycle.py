"""The transitions of a plan from draft to published, superseded or withdrawn."""

from __future__ import annotations

from datetime import datetime
from typing import cast

from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.access.callers import Caller
from service.db import clock
from service.db.rows import PlanRow
from service.plans import store
from service.problems.faults import refuse_one, require_none
from service.problems.kinds import ServiceError
from service.webhooks import outbox
from service.wire.plans import TRANSITIONS, PlanState, TransitionIn


def move(session: Session, caller: Caller, plan: PlanRow, body: TransitionIn) -> None:
    """Move a plan to another state; its row must be locked, and publishing too if requested.

    Raises
    ------
    ServiceError
        If the state does not allow it, a waiver is missing, or another plan was published since.
    """
    allowed = TRANSITIONS[cast(PlanState, plan.state)]
    if body.to not in allowed:
        where = ", ".join(allowed) or "nowhere"
        raise ServiceError(
            "invalid_transition",
            f"The plan is {plan.state}: from there it can go to {where}, not to {body.to}.",
        )
    _require_fields(body)
    effective_from = None
    if body.to == "approved":
        _require_waivers(plan, body)
    elif body.to == "published":
        effective_from = max(body.effective_from or clock.now(session), plan.horizon_start)
        _supersede(session, caller, plan, effective_from)
    else:
        ends_at = clock.now(session)
        for row in store.satellites(session, [plan.id])[plan.id]:
            if row.in_force_from is not None and row.in_force_until is None:
                row.in_force_until = max(ends_at, row.in_force_from)
    before, plan.state = plan.state, body.to
    plan.version += 1
    store.note(session, caller, plan, before, body.reason, effective_from, body.waivers)
    outbox.tell_plan(session, plan, body.reason, effective_from)


def _require_fields(body: TransitionIn) -> None:
    """Refuse fields that do not apply to this transition, which would be silently ignored."""
    faults = [
        Fault(
            code="invalid_value",
            detail=f"{name} applies only to the transition to {wanted}.",
            pointer=f"/{name}",
        )
        for name, wanted, is_given in (
            ("waivers", "approved", bool(body.waivers)),
            ("effective_from", "published", body.effective_from is not None),
        )
        if is_given and body.to != wanted
    ]
    require_none(faults)


def _require_waivers(plan: PlanRow, body: TransitionIn) -> None:
    """Refuse an approval that leaves violations unwaived, or waives one that does not exist."""
    places = {f"/violations/{i}": each["code"] for i, each in enumerate(plan.violations)}
    waived = [each.violation for each in body.waivers]
    faults = [
        Fault(code="unknown_violation", detail=f"The plan has no violation {each!r}.",
              pointer=f"/waivers/{i}/violation")
        for i, each in enumerate(waived)
        if each not in places and each not in places.values()
    ]  # fmt: skip
    faults += [
        Fault(code="waiver_missing", pointer="/waivers",
              detail=f"The plan breaks a rule: {plan.violations[i]['detail']} "
              f"Waive {place} with a reason, or withdraw the plan.")
        for i, (place, code) in enumerate(places.items())
        if place not in waived and code not in waived
    ]  # fmt: skip
    require_none(faults)


def _supersede(session: Session, caller: Caller, plan: PlanRow, from_: datetime) -> None:
    """Put the plan in force from an instant on, replacing the plans in force."""
    if from_ >= plan.horizon_end:
        detail = "The plan's horizon is over by then."
        raise refuse_one("value_out_of_range", detail, "/effective_from")
    rivals = store.in_force(session, plan, from_)
    others = {
        row.plan_id: session.get_one(PlanRow, row.plan_id, with_for_update=True) for row in rivals
    }
    approved_at = max(
        each.at for each in store.history(session, plan.id) if each.to_state == "approved"
    )
    for other in others.values():
        published_at = max(
            each.at for each in store.history(session, other.id)
            if each.to_state == "published"
        )  # fmt: skip
        if published_at >= approved_at and other.id != plan.parent_id:
            raise ServiceError(
                "plan_overtaken",
                f"Plan {other.id} was published for the same satellites after this one was "
                "approved. Look at it, and approve a plan that follows it.",
            )
    for row in rivals:
        row.in_force_until = max(from_, row.in_force_from or from_)
    session.flush()
    satellites = store.satellites(session, [plan.id, *others])
    for other in others.values():
        if all(row.in_force_until is not None for row in satellites[other.id]):
            other.state, other.version = "superseded", other.version + 1
            reason = f"Superseded by plan {plan.id}."
            store.note(session, caller, other, "published", reason, from_)
            outbox.tell_plan(session, other, reason, from_)
    for row in satellites[plan.id]:
        row.in_force_from = from_

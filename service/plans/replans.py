"""The starting point of a replan, and the draft that results from it."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.access.callers import Caller, Scope
from service.db.ids import new_id
from service.db.rows import JobRow, PlanActionRow, PlanRow
from service.plans import store
from service.webhooks import outbox
from service.wire.base import Json
from service.wire.instants import instant_text
from service.wire.pins import PinnedActionIn
from service.wire.plan_before import FlownIn
from service.wire.stored import from_row
from service.wire.timelines import TimelineOut

_GONE: Final = ("failed", "skipped")


def base_of(session: Session, plan_id: str, from_: datetime | None = None) -> list[PinnedActionIn]:
    """Return the actions of a plan, without those reported as not done.

    Given an instant, only the parts of actions after it.
    """
    last = store.last_reports(session, plan_id)
    gone = {own_id for own_id, report in last.items() if report.outcome in _GONE}
    return [
        from_row(PinnedActionIn, row, start=max(row.start, from_ or row.start))
        for row in all_actions(session, plan_id)
        if row.action_id not in gone and (from_ is None or row.end > from_)
    ]


def flown_of(session: Session, plan_id: str, until: datetime) -> list[FlownIn]:
    """Return the actions of a plan that began before an instant, with their outcomes."""
    last = store.last_reports(session, plan_id)
    found = []
    for row in all_actions(session, plan_id):
        report = last.get(row.action_id)
        if row.start < until:
            outcome = "executed" if report is None else report.outcome
            mbit = None if report is None else report.mbit
            found.append(from_row(FlownIn, row, outcome=outcome, mbit=mbit))
    return found


def all_actions(session: Session, plan_id: str) -> list[PlanActionRow]:
    """Return the actions of a plan, in order."""
    wanted = sa.select(PlanActionRow).where(PlanActionRow.plan_id == plan_id)
    return list(session.scalars(wanted.order_by(PlanActionRow.position)))


def note_of(plan: PlanRow, caller: Caller, name: str | None, freeze_until: datetime) -> Json:
    """Return what a replan's job must remember, including the id of the draft."""
    return {
        "replan_of": plan.id,
        "plan_id": new_id(),
        "name": name,
        "freeze_until": instant_text(freeze_until),
        "key_name": caller.key_name,
    }


def is_replan(change: Json | None) -> bool:
    """Return whether the change of a job is a replan."""
    return change is not None and "replan_of" in change


def adopt(session: Session, job: JobRow, timeline: TimelineOut) -> None:
    """Store the plan found by a replan's job as a draft."""
    change: dict[str, Any] = job.change or {}
    parent = session.get_one(PlanRow, change["replan_of"])
    caller = Caller(owner=job.tenant, scope=Scope.SUBMIT, key_name=change["key_name"])
    plan = store.add(
        session, caller, parent.owner, job.id, change["name"], timeline,
        parent_id=parent.id, plan_id=change["plan_id"],
    )  # fmt: skip
    outbox.tell_plan(session, plan, None, None)

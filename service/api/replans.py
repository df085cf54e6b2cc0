"""Replans: what happened to a plan, and the plan that follows it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import datetime
from functools import partial

from fastapi import APIRouter
from sqlalchemy.orm import Session

from planner_core.domain import Agility
from planner_core.errors import Fault, pointing
from planner_core.problem.slew import INSTANT, slew_s
from planner_core.referee.plan_diff import PlannedAction
from planner_core.replanning.changes import Changed, changes_of, share_of
from service.api import job_intake as intake
from service.api.deps import CallDep
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.plans import action_out, find_plan
from service.api.telemetry import faults_of_states, take_down
from service.db import clock
from service.db.rows import JobRow, PlanActionRow, PlanRow, SatelliteRow, ScenarioRow
from service.plans import replans
from service.plans import store as plan_store
from service.problems.faults import require_none
from service.scenarios import freezing, replanning
from service.scenarios.pin_inputs import with_settled_pins
from service.scenarios.stored_question import StoredQuestion
from service.scenarios.translate import read_file
from service.stores import outage_store
from service.stores.finding import alive
from service.wire.jobs import JobOut
from service.wire.pins import StateIn
from service.wire.replans import PlanChangeItem, PlanChangesOut, ReplanIn
from service.wire.scenarios import FileSatellite, ScenarioFile

router = APIRouter(prefix="/v1/plans", tags=["plans"])

_WIDEST_TURN_DEG = 180.0
_NEAR_S = 1.0  # the tolerance with which base actions are matched


@router.post("/{plan_id}/replans", status_code=202, responses=problem_responses(404, 409, 422, 503))
def create_replan(plan_id: str, body: ReplanIn, call: CallDep, once: OnceDep) -> JobOut:
    """Queue a replan of this plan: actions that start before `freeze_until` stay as they are.

    The job's scenario is that of the plan with what happened: outages, reports, changed targets.
    As few actions as possible change; promised targets stay imaged, or the job fails with
    `promise_not_kept`. `links.plan` is the draft, which exists once the job has succeeded.
    """
    job = intake.asked_for(body, call)
    queue = intake.queue_with_room(call)
    with call.database.reading() as session:
        plan = find_plan(session, plan_id, call)
        scenario_id = session.get_one(JobRow, plan.job_id).scenario_id
        content = session.get_one(ScenarioRow, scenario_id).content
    file = read_file(json.loads(content))
    with once.transaction() as session:
        intake.require_room(session, call)
        plan = find_plan(session, plan_id, call)
        if body.executions:
            take_down(session, call, plan, body.executions, "/executions")
        now = body.now or clock.now(session)
        now = now.replace(microsecond=now.microsecond // 1000 * 1000)
        freeze_until = max(body.freeze_until or now, now)
        happened = _happened(session, plan, body, file, now, freeze_until)
        asked = replanning.replan_file(file, body, happened)
        with pointing(partial(replanning.place_in, body)):
            if body.keep or body.skip:
                asked = with_settled_pins(asked)
            frozen = freezing.freeze_file(asked, call.settings.scenario_limits)
        row, _ = intake.save(session, call, frozen, call.caller.owner)
        change = replans.note_of(plan, call.caller, body.name, freeze_until)
        return intake.queued(session, call, once, queue, job(scenario_id=row.id, change=change))


def _happened(
    session: Session,
    plan: PlanRow,
    body: ReplanIn,
    file: ScenarioFile,
    now: datetime,
    freeze_until: datetime,
) -> replanning.Happened:
    actions = replans.all_actions(session, plan.id)
    stations = {row.station_id for row in actions if row.station_id is not None}
    satellites = [row.satellite_id for row in plan_store.satellites(session, [plan.id])[plan.id]]
    stored = outage_store.concerning(
        session, satellites, stations, plan.horizon_start, body.horizon_end or plan.horizon_end
    )
    states = _telemetry(session, plan, body, file, now)
    is_corrected = bool(states) or any(
        row.outcome in ("failed", "partial") or row.mbit is not None
        for row in plan_store.last_reports(session, plan.id).values()
    )
    begins = now if is_corrected and now > file.horizon.start else None
    return replanning.Happened(
        base=replans.base_of(session, plan.id, begins),
        freeze_until=freeze_until,
        begins=begins,
        states=states,
        flown=[] if begins is None else replans.flown_of(session, plan.id, begins),
        elements=_newest(session, satellites) if body.elements == "newest" else {},
        outages=[outage_store.placed(row) for row in stored],
        targets=freezing.targets_by_catalog(session, body.add_target_catalog_ids),
    )


def _telemetry(
    session: Session, plan: PlanRow, body: ReplanIn, file: ScenarioFile, now: datetime
) -> dict[str, StateIn]:
    """Return each satellite's newest state, if it is no older than the one the plan began with."""
    faults = faults_of_states(session, plan, body.states, "/states")
    faults += [
        Fault(code="value_out_of_range", detail="A state cannot be later than now.",
              pointer=f"/states/{i}/at")
        for i, state in enumerate(body.states)
        if state.at > now
    ]  # fmt: skip
    require_none(faults)
    known = plan_store.last_states(session, plan.id, now)
    known |= {state.satellite_id: state for state in sorted(body.states, key=lambda s: s.at)}
    began = {state.satellite_id: state.at for state in file.states}
    return {
        own_id: state
        for own_id, state in known.items()
        if state.at >= began.get(own_id, file.horizon.start)
    }


def _newest(session: Session, satellite_ids: Sequence[str]) -> dict[str, FileSatellite]:
    """Return the satellites that are still stored, with their elements of today."""
    rows = session.scalars(alive(SatelliteRow).where(SatelliteRow.id.in_(satellite_ids)))
    return {str(one.id): one for one in freezing.satellites_of(session, [row.id for row in rows])}


@router.get("/{plan_id}/changes", responses=problem_responses(404))
def list_changes(plan_id: str, call: CallDep) -> PlanChangesOut:
    """List what a replan has changed after its freeze, and why; empty for any other plan."""
    with call.database.reading() as session:
        plan = find_plan(session, plan_id, call)
        job = session.get_one(JobRow, plan.job_id)
        if plan.parent_id is None or not replans.is_replan(job.change):
            return PlanChangesOut(
                parent_id=None, freeze_until=None, changed_share=0.0, forced_share=0.0, items=()
            )
        content = session.get_one(ScenarioRow, job.scenario_id).content
        rows = [replans.all_actions(session, own) for own in (plan.parent_id, plan.id)]
    assert job.change is not None
    freeze_until = datetime.fromisoformat(job.change["freeze_until"])
    question = StoredQuestion(content)
    before, after = (
        {planned(row): row for row in of_plan if row.start >= freeze_until} for of_plan in rows
    )
    found = changes_of(
        list(before), list(after), lambda one: _is_lost(question, one),
        {satellite.id: _longest_turn_s(satellite.agility) for satellite in question.satellites},
    )  # fmt: skip
    return PlanChangesOut(
        parent_id=plan.parent_id,
        freeze_until=freeze_until,
        changed_share=share_of(found, len(before)),
        forced_share=share_of(found, len(before), forced=True),
        items=tuple(_item(one, before, after) for one in found),
    )


def planned(row: PlanActionRow) -> PlannedAction:
    """Return an action in the form that all plans share."""
    return PlannedAction(
        start=row.start,
        end=row.end,
        satellite_id=row.satellite_id,
        mode="collect" if row.mode == "collect" else "contact",
        site_id=row.target_id or row.station_id or "",
    )


def _is_lost(question: StoredQuestion, action: PlannedAction) -> bool:
    """Return whether an outage, a failure or a dropped target rules out an action of the plan."""
    if action.mode == "collect" and action.site_id in question.pins.forbid:
        return True
    is_in_base = question.replan is not None and any(
        one.satellite_id == action.satellite_id
        and (one.target_id or one.station_id) == action.site_id
        and one.start is not None
        and abs((one.start - action.start).total_seconds()) <= _NEAR_S
        for one in question.replan.base
    )
    is_out = any(
        action.start < outage.end
        and action.end > outage.start
        and (
            (outage.satellite_id == action.satellite_id and action.mode in outage.modes)
            or (outage.station_id is not None and outage.station_id == action.site_id
                and action.mode == "contact")
        )
        for outage in question.outages
    )  # fmt: skip
    return is_out or not is_in_base


def _longest_turn_s(agility: Agility) -> float:
    acceleration = agility.acceleration_deg_s2 or INSTANT
    return slew_s(_WIDEST_TURN_DEG, agility.slew_rate_deg_s, acceleration) + agility.settle_s


def _item(
    found: Changed,
    before: dict[PlannedAction, PlanActionRow],
    after: dict[PlannedAction, PlanActionRow],
) -> PlanChangeItem:
    is_moved = found.before is not None and found.after is not None
    return PlanChangeItem(
        change="moved" if is_moved else "added" if found.before is None else "removed",
        action=None if found.after is None else action_out(after[found.after], None),
        parent_action=None if found.before is None else action_out(before[found.before], None),
        cause=found.cause,
        because_of=tuple(after[one].action_id for one in found.because_of),
    )

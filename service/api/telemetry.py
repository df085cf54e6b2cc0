"""Execution reports and telemetry of plans, which are added and never changed."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from typing import Any, Final, TypeVar

from fastapi import APIRouter
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.api.deps import ANY_FILE, Call, CallDep, RawBodyDep, file_type
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.imports import BYTES, request_body
from service.api.paging import PagingDep, newest_first
from service.api.plans import find_plan
from service.db.rows import ExecutionRow, JobRow, PlanRow, PlanStateRow, ScenarioRow
from service.files.records import Record, Records, check, read_csv, read_json
from service.plans import store as plan_store
from service.problems.faults import refuse_one, require_none
from service.problems.kinds import ServiceError
from service.scenarios.pin_inputs import state_from
from service.wire.base import Body, Listed
from service.wire.pins import StateIn
from service.wire.plans import (
    MAX_REPORTED,
    ExecutionIn,
    ExecutionOut,
    PlanStateOut,
    ReportedOut,
    StatesReportedOut,
)
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/plans", tags=["plans"])

B = TypeVar("B", bound=Body)

_TYPES: Final = ("application/json", "text/csv")
_STATE_COLUMNS: Final = (
    "satellite_id", "at", "battery_fraction", "recorder_fraction",
    "target_id", "station_id", "sun", "los_x", "los_y", "los_z",
)  # fmt: skip
_LINE_OF_SIGHT: Final = ("los_x", "los_y", "los_z")


def _bodies(schema: str, columns: str) -> dict[str, Any]:
    item = {"$ref": f"#/components/schemas/{schema}"}
    listed = {"type": "array", "items": item, "minItems": 1, "maxItems": MAX_REPORTED}
    table = {"type": "string", "description": columns}
    return request_body({"application/json": listed, "text/csv": table, ANY_FILE: BYTES})


@router.post(
    "/{plan_id}/executions",
    status_code=201,
    responses=problem_responses(404, 409, 413, 415, 422),
    openapi_extra=_bodies(
        "ExecutionIn", "A header with action_id, outcome and any of at, mbit, detail."
    ),
)
def report_executions(plan_id: str, data: RawBodyDep, call: CallDep, once: OnceDep) -> ReportedOut:
    """Report outcomes of actions. Reports are added, never changed: the last one counts."""
    reports = _reports(call, data, ExecutionIn, ExecutionIn.model_fields, ("action_id", "outcome"))
    with once.transaction() as session:
        plan = find_plan(session, plan_id, call)
        rows = take_down(session, call, plan, reports)
        executions = [from_row(ExecutionOut, row) for row in rows]
        return once.keep(session, ReportedOut(executions=executions))


def take_down(
    session: Session, call: Call, plan: PlanRow, reports: Sequence[ExecutionIn], at: str = ""
) -> list[ExecutionRow]:
    """Store reports of a published plan; the pointers of errors begin with ``at``."""
    _require_published(plan)
    unknown = plan_store.unknown_actions(session, plan.id, [r.action_id for r in reports])
    faults = [
        Fault(code="unknown_action", detail=f"The plan has no action {each.action_id!r}.",
              pointer=f"{at}/{i}/action_id")
        for i, each in enumerate(reports)
        if each.action_id in unknown
    ]  # fmt: skip
    require_none(faults)
    rows = plan_store.report(session, call.caller, plan.id, reports)
    call.audit.record(session, "report", "plan", plan.id)
    return rows


@router.get("/{plan_id}/executions", responses=problem_responses(404))
def list_executions(plan_id: str, call: CallDep, paging: PagingDep) -> Listed[ExecutionOut]:
    """List the execution reports of a plan, newest first."""
    with call.database.reading() as session:
        find_plan(session, plan_id, call)
        page = newest_first(session, plan_store.executions(plan_id), ExecutionRow.id, paging)
        return page.listed(lambda row: from_row(ExecutionOut, row))


@router.post(
    "/{plan_id}/states",
    status_code=201,
    responses=problem_responses(404, 409, 413, 415, 422),
    openapi_extra=_bodies(
        "StateIn",
        "A header with satellite_id, at and any of battery_fraction, recorder_fraction, and of one "
        "way to say where it looks: target_id, station_id, sun (true) or los_x, los_y, los_z.",
    ),
)
def report_states(
    plan_id: str, data: RawBodyDep, call: CallDep, once: OnceDep
) -> StatesReportedOut:
    """Add telemetry of the plan's satellites; replans start from the newest state of each."""
    required = ("satellite_id", "at")
    states = _reports(call, data, StateIn, _STATE_COLUMNS, required, _nested, state_from)
    with once.transaction() as session:
        plan = find_plan(session, plan_id, call)
        _require_published(plan)
        require_none(faults_of_states(session, plan, states, ""))
        rows = plan_store.report_states(session, call.caller, plan.id, states)
        call.audit.record(session, "report", "plan", plan.id)
        return once.keep(session, StatesReportedOut(states=tuple(map(_state_out, rows))))


@router.get("/{plan_id}/states", responses=problem_responses(404))
def list_states(plan_id: str, call: CallDep, paging: PagingDep) -> Listed[PlanStateOut]:
    """List telemetry of a plan, newest first."""
    with call.database.reading() as session:
        find_plan(session, plan_id, call)
        page = newest_first(session, plan_store.states(plan_id), PlanStateRow.id, paging)
        return page.listed(_state_out)


def faults_of_states(
    session: Session, plan: PlanRow, states: Sequence[StateIn], at: str
) -> list[Fault]:
    """Return the faults of states that name what the plan lacks; pointers begin with ``at``."""
    own = {row.satellite_id for row in plan_store.satellites(session, [plan.id])[plan.id]}
    faults = [
        Fault(code="unknown_satellite", pointer=f"{at}/{i}/satellite_id",
              detail=f"The plan has no satellite {state.satellite_id!r}.")
        for i, state in enumerate(states)
        if state.satellite_id not in own
    ]  # fmt: skip
    named = [
        (f"{at}/{i}/on_board/{k}/target_id", image.target_id)
        for i, state in enumerate(states)
        for k, image in enumerate(state.on_board or ())
    ]
    named += [
        (f"{at}/{i}/attitude/target_id", state.attitude.target_id)
        for i, state in enumerate(states)
        if state.attitude is not None and state.attitude.target_id is not None
    ]
    if not named:
        return faults
    scenario_id = session.get_one(JobRow, plan.job_id).scenario_id
    content = json.loads(session.get_one(ScenarioRow, scenario_id).content)
    known = {target["id"] for target in content["targets"]}
    return faults + [
        Fault(code="unknown_target", detail=f"The plan has no target {name!r}.", pointer=pointer)
        for pointer, name in named
        if name not in known
    ]


def _require_published(plan: PlanRow) -> None:
    if plan.state in ("draft", "approved"):
        raise ServiceError(
            "invalid_transition", f"The plan is {plan.state}: it has not been published yet."
        )


def _reports(
    call: Call,
    data: bytes,
    schema: type[B],
    columns: Collection[str],
    required: Collection[str],
    of_row: Callable[[Record], Record] = lambda record: record,
    build: Callable[[B], object] = lambda body: body,
) -> list[B]:
    """Return the reports of a body; raise an error with every fault and its place if any."""
    if file_type(call.request, data, *_TYPES) == "text/csv":
        found = read_csv(data, columns, required, most=MAX_REPORTED)
        records = tuple(map(of_row, found.records))
    else:
        found = _listed(data)
        records = found.records
    good, faults = check(records, schema, build)
    require_none([*faults, *found.faults])
    return [one.body for one in good]


def _listed(data: bytes) -> Records:
    document = read_json(data)
    if not isinstance(document, list) or not 1 <= len(document) <= MAX_REPORTED:
        detail = f"Send a list of 1 to {MAX_REPORTED} reports."
        raise refuse_one("value_out_of_range", detail, "")
    return Records(
        records=tuple(Record(fields=one, pointer=f"/{i}") for i, one in enumerate(document))
    )


def _nested(record: Record) -> Record:
    """Return a row of telemetry with its attitude as one field."""
    fields = dict(record.fields)
    attitude: dict[str, object] = {
        name: fields.pop(name) for name in ("target_id", "station_id") if name in fields
    }
    if "sun" in fields:
        sun = fields.pop("sun")
        attitude["sun"] = str(sun).lower() in ("true", "1", "yes") or sun
    look = [fields.pop(name, None) for name in _LINE_OF_SIGHT]
    if any(value is not None for value in look):
        attitude["line_of_sight"] = [float(v) if isinstance(v, int) else v for v in look]
    if attitude:
        fields["attitude"] = attitude
    return Record(fields=fields, row=record.row)


def _state_out(row: PlanStateRow) -> PlanStateOut:
    return from_row(PlanStateOut, row, **row.body)

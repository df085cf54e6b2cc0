"""Comparisons: several solvers on one frozen scenario, and one table of what they found."""

from __future__ import annotations

from collections.abc import Sequence

import sqlalchemy as sa
from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from planner_core.errors import inside
from service.api import job_intake as intake
from service.api.conditional import matched, readable, unless_known
from service.api.deps import Call, CallDep
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.job_shapes import SOON_S
from service.api.paging import PagingDep, newest_first
from service.db.rows import ComparisonRow
from service.jobs import submission
from service.stores import comparison_store as store
from service.stores import deletion, job_store
from service.stores.comparison_store import Run
from service.stores.finding import no_such, of_owner
from service.wire.base import Listed
from service.wire.jobs import (
    ACTIVE,
    ComparedRun,
    ComparisonIn,
    ComparisonOut,
    FiguresOut,
    ScenarioRef,
)
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/comparisons", tags=["comparisons"])


@router.post("", status_code=202, responses=problem_responses(503))
def create_comparison(body: ComparisonIn, call: CallDep, once: OnceDep) -> ComparisonOut:
    """Queue a job for each run, all or none; the answer's `Location` is where to find the table."""
    params = []
    for position, run in enumerate(body.runs):
        with inside(f"/runs/{position}"):
            params.append(intake.all_params(run.solver, run.params))
    limits = intake.limits_of(body.limits, call.settings)
    inline = intake.frozen(call, body)
    queue = intake.queue_with_room(call, len(body.runs))
    with once.transaction() as session:
        intake.require_room(session, call, len(body.runs))
        scenario_id = intake.stored_scenario(session, call, body, inline)
        specs = [
            submission.JobSpec(
                scenario_id=scenario_id,
                solver=run.solver,
                params=of_run,
                seed=run.seed,
                limits=limits,
                priority=body.priority,
                label=body.label,
                owner=call.caller.owner,
            )
            for run, of_run in zip(body.runs, params, strict=True)
        ]
        row = submission.submit_comparison(session, queue, specs, label=body.label)
        shown = _shown(session, [row])[0]
        call.audit.record(session, "create", "job", *(run.job_id for run in shown.runs))
        _describe(call.response, shown)
        return once.created(session, "comparison", row.id, shown)


@router.get("")
def list_comparisons(call: CallDep, paging: PagingDep) -> Listed[ComparisonOut]:
    """List the comparisons of the key's owner, newest first; all for the scope `admin`."""
    own = of_owner(ComparisonRow.tenant, call.caller.visible_owner)
    query = sa.select(ComparisonRow).where(own)
    with call.database.reading() as session:
        page = newest_first(session, query, ComparisonRow.id, paging, store.weight())
        return Listed(items=_shown(session, page.rows), next=page.next)


@router.get("/{comparison_id}", response_model=ComparisonOut, responses=readable())
def get_comparison(comparison_id: str, call: CallDep) -> ComparisonOut | Response:
    """Return the table as it stands; a row is filled in when its job has an answer."""
    with call.database.reading() as session:
        shown = _shown(session, [_find(session, comparison_id, call)])[0]
    _describe(call.response, shown)
    return unless_known(call, shown)


@router.delete("/{comparison_id}", status_code=204, responses=problem_responses(404, 412))
def delete_comparison(comparison_id: str, call: CallDep) -> None:
    """Delete a comparison. The jobs of its runs remain."""
    with call.noted("delete", "comparison", comparison_id) as session:
        row = _find(session, comparison_id, call)
        matched(call, row, lambda row: _shown(session, [row])[0])
        deletion.delete_comparison(session, comparison_id)


def _find(session: Session, comparison_id: str, call: Call) -> ComparisonRow:
    row = session.get(ComparisonRow, comparison_id)
    if row is None or call.caller.visible_owner not in (None, row.tenant):
        raise no_such("comparison", comparison_id)
    return row


def _describe(response: Response, shown: ComparisonOut) -> None:
    if shown.state == "running":
        response.headers["Retry-After"] = str(SOON_S)


def _shown(session: Session, rows: Sequence[ComparisonRow]) -> list[ComparisonOut]:
    runs = store.runs_of(session, [row.id for row in rows])
    hashes = job_store.hashes_of(session, {row.scenario_id for row in rows})
    return [_table(row, runs[row.id], hashes[row.scenario_id]) for row in rows]


def _table(row: ComparisonRow, runs: list[Run], sha256: str) -> ComparisonOut:
    is_active = any(run.job.state in ACTIVE for run in runs)
    return from_row(
        ComparisonOut,
        row,
        state="running" if is_active else "finished",
        scenario=ScenarioRef(id=row.scenario_id, sha256=sha256),
        runs=[_line(run) for run in runs],
        links={"self": f"/v1/comparisons/{row.id}", "scenario": f"/v1/scenarios/{row.scenario_id}"},
    )


def _line(run: Run) -> ComparedRun:
    address = f"/v1/jobs/{run.job.id}"
    links = {"job": address, "timeline": f"{address}/timeline"}
    figures = FiguresOut(**(run.figures or {}))
    return from_row(ComparedRun, run.job, job_id=run.job.id, links=links, **dict(figures))

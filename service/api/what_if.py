"""What if: the question of a job once more, with one change."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, cast

from fastapi import APIRouter, Depends

from service.answers.variations import Asked, Variations
from service.api import job_intake as intake
from service.api.deps import CallDep, own_job_only
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.db.rows import JobRow, ScenarioRow
from service.jobs import submission
from service.settings import Settings
from service.stores import opportunity_store
from service.wire.changes import ChangeIn
from service.wire.jobs import JobOut, LimitsIn, WhatIfIn

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])

_CHANGE: Final = set(ChangeIn.model_fields)


@router.post("/{job_id}/what-if", status_code=202, responses=problem_responses(404, 409, 503))
def create_what_if(job_id: str, body: WhatIfIn, call: CallDep, once: OnceDep) -> JobOut:
    """Queue the question of a job with a change, as a scenario and a job of their own.

    `links.what_if_of` leads to the job, `change` repeats what was asked, and
    `GET /v1/jobs/{job_id}/diff/{other_id}` tells what came of it. A target is forced by the
    image that the job's plan holds, or by the one that costs that plan least. What cannot be is
    refused with its place in the body; working that out may take a while: 503 with
    `Retry-After` asks to come back.
    """
    queue = intake.queue_with_room(call)
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
        timeline = intake.find_timeline(session, job) if body.needs_plan else None
        scenario = session.get_one(ScenarioRow, job.scenario_id)
        content, sha256 = scenario.content, scenario.sha256
    asked = Asked(
        content=content, timeline=timeline, change=body, limits=call.settings.scenario_limits
    )
    solver, params = _solver(job, body)
    limits = _limits(job, body, call.settings)
    described = intake.described(call, job.scenario_id, sha256)
    varied = cast(Variations, call.request.app.state.variations).get(asked, described)
    with once.transaction() as session:
        intake.require_room(session, call)
        row, is_new = intake.save(session, call, varied.frozen, call.caller.owner)
        if is_new:
            call.count_stored(session, num_bytes=len(varied.opportunity_block))
            opportunity_store.save(session, row.sha256, varied.opportunity_block)
        spec = replace(
            submission.spec_again(job, call.caller.owner),
            scenario_id=row.id,
            solver=solver,
            params=params,
            limits=limits,
            rerun_of=None,
            what_if_of=job_id,
            change=body.model_dump(mode="json", include=_CHANGE, exclude_unset=True),
            **body.model_dump(include={"seed", "priority", "label"}, exclude_none=True),
        )
        return intake.queued(session, call, once, queue, spec)


def _solver(job: JobRow, body: WhatIfIn) -> tuple[str, dict[str, Any]]:
    """Return the solver and all its parameters: those of the job belong to its solver."""
    solver = body.solver or job.solver
    if body.params is None and solver == job.solver:
        return solver, dict(job.params)
    return solver, intake.all_params(solver, body.params or {})


def _limits(job: JobRow, body: WhatIfIn, settings: Settings) -> dict[str, float]:
    given = body.limits.model_dump(exclude_none=True)
    if not given:
        return job.limits
    return intake.limits_of(LimitsIn(**job.limits | given), settings)

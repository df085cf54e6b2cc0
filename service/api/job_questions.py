"""Questions about a job's plan: explanations of targets, differences to others, what-ifs."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Final, cast

from fastapi import APIRouter, Depends, Path, Response

from planner_core.referee.plan_diff import PlannedAction, plan_diff
from service.answers.explanations import Explainer, version_of
from service.answers.rebuilt import view_of
from service.answers.variations import Asked, Variations
from service.api import job_intake as intake
from service.api.conditional import etag_of, known_as, readable
from service.api.deps import CallDep, own_job_only
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.db.rows import JobRow, ScenarioRow
from service.jobs import submission
from service.problems.kinds import ServiceError
from service.settings import Settings
from service.stores import job_store as store
from service.stores import opportunity_store
from service.stores.finding import no_such
from service.wire.base import read
from service.wire.changes import ChangeIn
from service.wire.jobs import JobOut, LimitsIn, WhatIfIn
from service.wire.outcomes import ExplanationOut
from service.wire.plan_diffs import Difference, DiffOut, MovedOut, PlannedOut, TotalDiff
from service.wire.timelines import TimelineOut

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])

_CHANGE: Final = set(ChangeIn.model_fields)


@router.get(
    # Ids of targets may contain slashes.
    "/{job_id}/targets/{target_id:path}/explanation",
    response_model=ExplanationOut,
    responses=readable(409, 503),
)
def get_explanation(
    job_id: str,
    target_id: Annotated[str, Path(description="Percent-encoded, including slashes.")],
    call: CallDep,
) -> ExplanationOut | Response:
    """Explain one target: what each of its opportunities would break, displace and earn.

    The answer is computed on request, which may take a while: 503 with `Retry-After` asks to try
    again later.
    """
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
        timeline = intake.find_timeline(session, job)
        sha256 = store.hashes_of(session, [job.scenario_id])[job.scenario_id]
    described = intake.described(call, job.scenario_id, sha256)
    ids = [target.id for target in described.scenario.targets]
    if target_id not in ids:
        raise ServiceError("not_found", f"The job has no target {target_id!r}.")
    etag = etag_of(version_of(job_id, target_id))
    explainer = cast(Explainer, call.request.app.state.explainer)
    return known_as(call, etag) or explainer.get(job_id, described, timeline, ids.index(target_id))


@router.get("/{job_id}/diff/{other_id}", response_model=DiffOut, responses=readable(409))
def get_diff(job_id: str, other_id: str, call: CallDep) -> DiffOut | Response:
    """Compare the plans of two jobs: actions added, removed and moved, and the totals.

    Plans of different questions can be compared as well, by the ids of satellites, targets and
    stations; `questions_differ_in` says how the questions differ.
    """
    with call.database.reading() as session:
        if call.caller.visible_owner not in (None, store.owner_of(session, other_id)):
            raise no_such("job", other_id)
        jobs = [intake.find_job(session, own_id) for own_id in (job_id, other_id)]
        before, after = (intake.find_timeline(session, job) for job in jobs)
    etag = etag_of(f"{job_id}/{other_id}")  # timelines never change
    return known_as(call, etag) or _diff(job_id, other_id, before, after)


def _diff(job_id: str, other_id: str, before: str, after: str) -> DiffOut:
    first, second = read(TimelineOut, before), read(TimelineOut, after)
    one, other = view_of(first), view_of(second)
    found = plan_diff(one, other)
    names = _Names(first, second)
    return DiffOut(
        before=job_id,
        after=other_id,
        is_empty=found.is_empty,
        questions_differ_in=_differences(first, second),
        added=[names.shown(action) for action in found.added],
        removed=[names.shown(action) for action in found.removed],
        moved=[MovedOut(before=names.shown(a), after=names.shown(b)) for a, b in found.moved],
        totals={
            name: TotalDiff(before=one.totals[name], after=other.totals[name], delta=delta)
            for name, delta in found.totals.items()
        },
    )


def _differences(first: TimelineOut, second: TimelineOut) -> tuple[Difference, ...]:
    differ: dict[Difference, bool] = {
        "scenario": first.scenario_sha256 != second.scenario_sha256,
        "horizon": first.horizon != second.horizon,
        "satellites": {s.id for s in first.satellites} != {s.id for s in second.satellites},
        "use_resources": first.use_resources != second.use_resources,
        "dynamics": first.dynamics != second.dynamics,
    }
    return tuple(part for part, is_other in differ.items() if is_other)


class _Names:
    """The names of satellites, targets and stations in the timelines."""

    def __init__(self, *timelines: TimelineOut):
        self._satellites = {s.id: s.name for t in timelines for s in t.satellites}
        actions = [a for t in timelines for s in t.satellites for a in s.actions]
        self._targets = {action.target_id: action.target_name for action in actions}
        self._stations = {action.station_id: action.station_name for action in actions}

    def shown(self, action: PlannedAction) -> PlannedOut:
        """Return an action as clients see it."""
        is_collect = action.mode == "collect"
        return PlannedOut(
            satellite_id=action.satellite_id,
            satellite_name=self._satellites[action.satellite_id],
            mode="collect" if is_collect else "contact",
            target_id=action.site_id if is_collect else None,
            target_name=self._targets[action.site_id] if is_collect else None,
            station_id=None if is_collect else action.site_id,
            station_name=None if is_collect else self._stations[action.site_id],
            start=action.start,
            end=action.end,
        )


@router.post("/{job_id}/what-if", status_code=202, responses=problem_responses(404, 409, 503))
def create_what_if(job_id: str, body: WhatIfIn, call: CallDep, once: OnceDep) -> JobOut:
    """Queue the question of a job with a change, as a new scenario and a new job.

    `links.what_if_of` names the original job, `change` repeats the request, and
    `GET /v1/jobs/{job_id}/diff/{other_id}` shows the effect. A forced target is imaged as in the
    job's plan, or else by the image that costs that plan least. An impossible change is refused
    with its place in the body. Checking this may take a while: 503 with `Retry-After` asks to try
    again later.
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
    """Return the solver and all its parameters; those of the job apply only to its own solver."""
    solver = body.solver or job.solver
    if body.params is None and solver == job.solver:
        return solver, dict(job.params)
    return solver, intake.all_params(solver, body.params or {})


def _limits(job: JobRow, body: WhatIfIn, settings: Settings) -> dict[str, float]:
    given = body.limits.model_dump(exclude_none=True)
    if not given:
        return job.limits
    return intake.limits_of(LimitsIn(**job.limits | given), settings)

"""Why a target is in a plan or not, at length."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import APIRouter, Depends, Path, Response

from service.answers.explanations import Explainer, version_of
from service.api import job_intake as intake
from service.api.conditional import etag_of, known_as, readable
from service.api.deps import CallDep, own_job_only
from service.problems.kinds import ServiceError
from service.stores.job_store import hashes_of
from service.wire.outcomes import ExplanationOut

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])


@router.get(
    # Ids of targets may hold slashes.
    "/{job_id}/targets/{target_id:path}/explanation",
    response_model=ExplanationOut,
    responses=readable(409, 503),
)
def get_explanation(
    job_id: str,
    target_id: Annotated[str, Path(description="Percent-encoded, slashes too.")],
    call: CallDep,
) -> ExplanationOut | Response:
    """Explain one target, opportunity by opportunity: what it breaks, displaces and earns.

    It is worked out when it is asked for, which may take a while: 503 with `Retry-After` asks
    to come back.
    """
    with call.database.reading() as session:
        job = intake.find_job(session, job_id)
        timeline = intake.find_timeline(session, job)
        sha256 = hashes_of(session, [job.scenario_id])[job.scenario_id]
    described = intake.described(call, job.scenario_id, sha256)
    ids = [target.id for target in described.scenario.targets]
    if target_id not in ids:
        raise ServiceError("not_found", f"The job has no target {target_id!r}.")
    etag = etag_of(version_of(job_id, target_id))
    if (known := known_as(call, etag)) is not None:
        return known
    explainer = cast(Explainer, call.request.app.state.explainer)
    return explainer.get(job_id, described, timeline, ids.index(target_id))

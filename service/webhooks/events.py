"""What events tell of jobs and of plans."""

from __future__ import annotations

from datetime import datetime

from service.db.rows import JobRow, PlanRow
from service.wire.plans import PlanChange
from service.wire.stored import from_row
from service.wire.webhooks import JobEnd


def end_of(job: JobRow) -> JobEnd:
    """Return what an event tells of a job: enough to decide whether to fetch the rest."""
    address = f"/v1/jobs/{job.id}"
    links = {"job": address, "timeline": f"{address}/timeline"}
    return from_row(JobEnd, job, job_id=job.id, warnings=job.warnings or (), links=links)


def change_of(plan: PlanRow, reason: str | None, effective_from: datetime | None) -> PlanChange:
    """Return what an event tells of a plan."""
    links = {"plan": f"/v1/plans/{plan.id}", "job": f"/v1/jobs/{plan.job_id}"}
    return from_row(
        PlanChange, plan, plan_id=plan.id, reason=reason, effective_from=effective_from, links=links
    )

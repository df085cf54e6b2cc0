"""What clients send and see of jobs."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa

from service.api import ask_again
from service.db.rows import JobRow
from service.wire.jobs import JobOut, ScenarioRef
from service.wire.stored import from_row


def shown(job: JobRow, scenario_sha256: str) -> JobOut:
    """Return a job as clients see it."""
    address = f"/v1/jobs/{job.id}"
    return from_row(
        JobOut,
        job,
        scenario=ScenarioRef(id=job.scenario_id, sha256=scenario_sha256),
        attempt=max(job.run, 1),
        warnings=job.warnings or (),
        links={
            "self": address,
            "timeline": f"{address}/timeline",
            "targets": f"{address}/targets",
            "events": f"{address}/events",
            "scenario": f"/v1/scenarios/{job.scenario_id}",
        }
        | ({} if job.rerun_of is None else {"rerun_of": f"/v1/jobs/{job.rerun_of}"})
        | ({} if job.what_if_of is None else {"what_if_of": f"/v1/jobs/{job.what_if_of}"})
        | _links_of_replan(job.change),
    )


def _links_of_replan(change: dict[str, Any] | None) -> dict[str, str]:
    if change is None or "replan_of" not in change:
        return {}
    return {
        "plan": f"/v1/plans/{change['plan_id']}",
        "replan_of": f"/v1/plans/{change['replan_of']}",
    }


def etag_of_job(job: JobRow | sa.Row[Any]) -> str:
    """Return the ETag of a job's present form."""
    return f'"{job.version}"'


def headers_of(job: JobRow | sa.Row[Any]) -> dict[str, str]:
    """Return the headers that every answer about one job has."""
    headers = {"ETag": etag_of_job(job)}
    seconds = ask_again.seconds_until(job.state, job.created_at)
    return headers if seconds is None else headers | {"Retry-After": str(seconds)}


def etag_of_timeline(job_id: str) -> str:
    """Return the ETag of a job's timeline document, which never changes."""
    return f'"{job_id}"'

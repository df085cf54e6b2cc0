"""What is told: the events, and how each reads."""

from __future__ import annotations

from service.db.rows import JobRow
from service.wire.webhooks import JobEnd


def event_of(state: str) -> str:
    """Return the event of a job that has reached this final state.

    >>> event_of("failed")
    'job.failed'
    """
    return f"job.{state}"


def end_of(job: JobRow) -> JobEnd:
    """Return what an event tells of a job: enough to decide whether to fetch the rest."""
    address = f"/v1/jobs/{job.id}"
    return JobEnd(
        job_id=job.id,
        state=job.state,
        termination=job.termination,
        error=job.error,
        validity=job.validity,
        warnings=job.warnings or (),
        solver=job.solver,
        label=job.label,
        scenario_id=job.scenario_id,
        links={"job": address, "timeline": f"{address}/timeline"},
    )

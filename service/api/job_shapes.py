"""Jobs as clients see them, and when clients should ask again."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, Final

import sqlalchemy as sa

from service.db.rows import JobRow
from service.wire.jobs import ACTIVE, JobOut, ScenarioRef
from service.wire.stored import from_row

SOON_S: Final = 1
_LATEST_S: Final = 5
_SHARE: Final = 0.2


def shown(job: JobRow, scenario_sha256: str) -> JobOut:
    """Return a job as clients see it."""
    address = f"/v1/jobs/{job.id}"
    links = {"self": address}
    links |= {part: f"{address}/{part}" for part in ("timeline", "targets", "events")}
    links["scenario"] = f"/v1/scenarios/{job.scenario_id}"
    if job.rerun_of is not None:
        links["rerun_of"] = f"/v1/jobs/{job.rerun_of}"
    if job.what_if_of is not None:
        links["what_if_of"] = f"/v1/jobs/{job.what_if_of}"
    if job.change is not None and "replan_of" in job.change:
        links["plan"] = f"/v1/plans/{job.change['plan_id']}"
        links["replan_of"] = f"/v1/plans/{job.change['replan_of']}"
    return from_row(
        JobOut,
        job,
        scenario=ScenarioRef(id=job.scenario_id, sha256=scenario_sha256),
        attempt=max(job.run, 1),
        warnings=job.warnings or (),
        links=links,
    )


def etag_of_job(job: JobRow | sa.Row[Any]) -> str:
    """Return the ETag of a job's present form."""
    return f'"{job.version}"'


def headers_of(job: JobRow | sa.Row[Any]) -> dict[str, str]:
    """Return the headers that every answer about one job has."""
    headers = {"ETag": etag_of_job(job)}
    seconds = seconds_until(job.state, job.created_at)
    return headers if seconds is None else headers | {"Retry-After": str(seconds)}


def seconds_until(state: str, created_at: datetime) -> int | None:
    """Return the ``Retry-After`` of a job in seconds; None if it has ended.

    A job that has waited long will hardly start within a second: asking after a fifth of the time
    that it has waited delays clients little, and spares the service most calls of a long queue.

    >>> from datetime import timedelta
    >>> ago = [datetime.now(UTC) - timedelta(seconds=waited_s) for waited_s in (0, 16, 600)]
    >>> [seconds_until("queued", created_at) for created_at in ago]
    [1, 3, 5]
    >>> seconds_until("running", ago[2]), seconds_until("succeeded", ago[2])
    (1, None)
    """
    if state not in ACTIVE:
        return None
    if state != "queued":
        return SOON_S
    # One time is by the database's clock, the other by ours: a second matters little.
    waited_s = (datetime.now(UTC) - created_at).total_seconds()
    return min(_LATEST_S, max(SOON_S, int(_SHARE * waited_s)))


def etag_of_timeline(job_id: str) -> str:
    """Return the ETag of a job's timeline document, which never changes."""
    return f'"{job_id}"'

"""Repair: find jobs that nobody runs and claims that are no longer needed.

Every worker does this every few seconds; guarded updates make concurrent repairs safe.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta

import sqlalchemy as sa

from service.db import clock
from service.db.clock import utc_now
from service.db.rows import JobRow
from service.db.session import Database
from service.jobs import lease
from service.jobs.queue import JobQueue

log = logging.getLogger(__name__)


class Reconciler:
    """Repairs the jobs of one database.

    Parameters
    ----------
    lease_s
        How long a claim may go without a sign of life.
    max_attempts
        A job that loses its worker this often fails, since it is probably the cause.
    page
        How many waiting jobs are compared with the queue at a time.
    """

    def __init__(
        self,
        database: Database,
        queue: JobQueue,
        *,
        lease_s: float,
        max_attempts: int,
        page: int = 200,
    ):
        self._database = database
        self._queue = queue
        self._lease_s = lease_s
        self._max_attempts = max_attempts
        self._page = page
        self._checked_up_to = ""
        self._looked_at: datetime | None = None
        self._judges_from: datetime | None = None

    def run(self) -> None:
        """Check everything once."""
        with self._database.reading() as session:
            now = clock.now(session)
        if self._may_judge(now):
            for job_id in self._expired():
                self._recover(job_id)
        oldest = now - timedelta(seconds=self._lease_s)
        claims = [claim for claim in self._queue.claims() if claim.claimed_at < oldest]
        current = self._current(claim.job_id for claim in claims)
        for claim in claims:
            if current.get(claim.job_id) == (claim.dispatch, "queued"):
                self._return(claim.job_id, claim.dispatch)
            elif current.get(claim.job_id) not in (
                (claim.dispatch, "running"),
                (claim.dispatch, "cancelling"),
            ):
                self._queue.cancel(claim.job_id, claim.dispatch)
        for job_id, dispatch in sorted(self._queue.lost(self._next_waiting())):
            self._return(job_id, dispatch)

    def _may_judge(self, now: datetime) -> bool:
        """Return whether a lapsed lease means a dead worker.

        Nobody can renew a lease while the database is away, full or locked, and a job must not
        be blamed for that. After a long gap without a look, the others get one lease time to renew.
        """
        lease_time = timedelta(seconds=self._lease_s)
        was_blind = self._looked_at is not None and now - self._looked_at > lease_time / 2
        self._looked_at = now
        if self._judges_from is None and was_blind:
            self._judges_from = now + lease_time
        if self._judges_from is not None and now < self._judges_from:
            return False
        self._judges_from = None
        return True

    def _expired(self) -> Sequence[str]:
        with self._database.reading() as session:
            return session.scalars(
                sa.select(JobRow.id).where(
                    JobRow.state.in_(("running", "cancelling")), JobRow.lease_until < utc_now()
                )
            ).all()

    def _recover(self, job_id: str) -> None:
        """End a job whose lease has lapsed, or queue it again, in one transaction."""
        expired = JobRow.lease_until < utc_now()
        cancelling = expired & (JobRow.state == "cancelling")
        running = expired & (JobRow.state == "running")
        last = running & (JobRow.lost_runs + 1 >= self._max_attempts)
        lost = JobRow.lost_runs + 1
        detail = f"The worker died or was cut off {self._max_attempts} times while it ran this job."
        failed = {"state": "failed", "error": {"code": "too_many_attempts", "detail": detail}}
        with self._database.transaction() as session:
            done = (
                lease.end(session, job_id, cancelling, state="cancelled")
                or lease.end(session, job_id, last, lost_runs=lost, **failed)
                or lease.redispatch(session, self._queue, running, job_id, lost_runs=lost)
            )
        if done:
            log.warning("recovered a job whose worker is gone", extra={"job_id": job_id})

    def _current(self, job_ids: Iterable[str]) -> dict[str, tuple[int, str]]:
        wanted = sa.select(JobRow.id, JobRow.dispatch, JobRow.state).where(
            JobRow.id.in_(set(job_ids))
        )
        with self._database.reading() as session:
            return {row.id: (row.dispatch, row.state) for row in session.execute(wanted)}

    def _next_waiting(self) -> list[tuple[str, int]]:
        """Return the next page of long-queued jobs, so that a long queue is checked in steps."""
        page = (
            sa.select(JobRow.id, JobRow.dispatch)
            .where(
                JobRow.state == "queued",
                JobRow.dispatched_at < utc_now(-self._lease_s),
                JobRow.id > self._checked_up_to,
            )
            .order_by(JobRow.id)
            .limit(self._page)
        )
        with self._database.reading() as session:
            found = [(row.id, row.dispatch) for row in session.execute(page)]
        self._checked_up_to = found[-1][0] if len(found) == self._page else ""
        return found

    def _return(self, job_id: str, dispatch: int) -> None:
        with self._database.transaction() as session:
            returned = lease.return_unstarted(session, self._queue, job_id, dispatch)
        if returned:
            # Its old claim, if any, must not occupy a slot of the tenant.
            self._queue.cancel(job_id, dispatch)
            log.warning("queued a job again that had never started", extra={"job_id": job_id})

"""One worker: claims jobs, runs each in a solver process, and recovers the jobs of others."""

from __future__ import annotations

import dataclasses
import logging
import os
import secrets
import socket
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final, TypeVar

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from planner_core.budget import Progress
from service.answers.chunks import proof_chunks
from service.db.clock import utc_now
from service.db.failures import why_unavailable
from service.db.rows import JobRow, PlanActionRow, PlanRow, ScenarioRow, WorkerRow
from service.db.session import Database
from service.jobs import lease
from service.jobs.child import Answered, Ending, Refused, Stopped
from service.jobs.held import HeldBlocks, make_folder, remove_folder
from service.jobs.lease import Lease, Outcome
from service.jobs.plan_request import Parcel, Parent, PlanAnswer, PlanRequest
from service.jobs.queue import DbosConsumer, DbosQueue
from service.jobs.reconcile import Reconciler
from service.jobs.renewal import Renewal
from service.jobs.retention import Retention
from service.jobs.runner import Abandoned, Limits, Lost, Order, Runner, Work
from service.process import tracing
from service.process.logs import about_job
from service.process.stopping import StopRequest
from service.process.tracing import JobSpan
from service.settings import Settings
from service.stores import bound_store, opportunity_store
from service.webhooks.courier import Courier

log = logging.getLogger(__name__)
T = TypeVar("T")

_RETRY_S: Final = 1.0
_COURIER_LOOKS_EVERY_S: Final = 0.2
_STOP_WITHIN_S: Final = 5.0
_FORGET_WORKER_S: Final = 86400.0


class Worker:
    """Runs one job at a time until told to stop.

    Parameters
    ----------
    settings
        The service's settings; the database must have been migrated.
    work
        What solver processes do.
    """

    def __init__(self, settings: Settings, work: Work):
        self.id = f"{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(4)}"
        self._settings = settings
        self._database = Database(settings.database_url, settings.database_timeout_s)
        self._queue = DbosQueue(settings.database_url, settings.database_timeout_s)
        self._runner = Runner(work)
        self._reconciler = Reconciler(
            self._database,
            self._queue,
            lease_s=settings.lease_s,
            max_attempts=settings.max_attempts,
        )
        self._retention = Retention(self._database, settings.retention_days)
        self._courier = Courier(
            self._database,
            look_every_s=_COURIER_LOOKS_EVERY_S,
            private=settings.webhook_private_addresses,
        )
        self._held_in = make_folder()
        self._stopping = threading.Event()
        self._stop_request = StopRequest()
        self._idle = threading.Event()
        self._idle.set()

    def stop(self) -> None:
        """Hand back the running job and let ``run`` return; safe in a signal handler."""
        self._stop_request.ask()

    def run(self, is_wanted: Callable[[], bool] = lambda: True) -> None:
        """Work until ``stop`` is called or ``is_wanted`` returns False."""
        if not self._runner.warm_up(lambda: is_wanted() and not self._is_stopping()):
            return
        consumer = DbosConsumer(
            self._settings.database_url, self.id, self.handle, self._settings.database_timeout_s
        )
        self._enrol()
        consumer.start()
        self._courier.start()
        try:
            while is_wanted() and not self._stop_request.wait(self._settings.reconcile_s):
                self._look_after_others()
        finally:
            self._stopping.set()
            self._idle.wait(_STOP_WITHIN_S)
            consumer.stop()
            self._courier.stop()
            self._leave()

    def _is_stopping(self) -> bool:
        return self._stopping.is_set() or self._stop_request.is_asked()

    def handle(self, job_id: str, dispatch: int) -> None:
        """Run one dispatch from the queue; how it ended is not reported to the queue."""
        self._idle.clear()
        try:
            self._handle(job_id, dispatch)
        except Exception:
            # The job's row still says queued or running: the reconciler will find it.
            log.exception("dispatch failed", extra={"job_id": job_id})
        finally:
            self._idle.set()

    def _handle(self, job_id: str, dispatch: int) -> None:
        if self._is_stopping():
            with self._database.transaction() as session:
                lease.return_unstarted(session, self._queue, job_id, dispatch)
            return
        with self._database.transaction() as session:
            own = lease.start(session, job_id, dispatch, lease_s=self._settings.lease_s)
        if own is None:
            return
        request, job = self._insist(
            self._database.reading,
            lambda session: _request(session, job_id, own.run, self._held_in),
        )
        named: dict[str, str | int] = {"job_id": job_id, "run": own.run, "solver": request.solver}
        if job.request_id is not None:
            named["request_id"] = job.request_id
        with (
            about_job(job_id, job.request_id),
            tracing.running(job.traceparent, **named) as span,
        ):
            self._run(own, request, span)

    def _run(self, held: Lease, request: PlanRequest, span: JobSpan) -> None:
        limits = Limits(
            time_s=float(request.limits["time_s"]),
            memory_mb=int(request.limits["memory_mb"]),
            num_threads=self._settings.threads_per_job,
        )
        renewal = Renewal(lambda progress: self._renew(held, progress))
        try:
            ending = self._runner.run(
                request,
                limits,
                tick_s=self._settings.heartbeat_s,
                tick=lambda progress: (
                    Order.ABANDON if self._is_stopping() else renewal.tick(progress)
                ),
                on_phase=span.enter_phase,
            )
        finally:
            renewal.end()
        span.enter_phase("store")
        state = self._conclude(held, request, ending)
        span.note_end(state, failed=isinstance(ending, Refused))
        log.info("a run ended", extra={"run": held.run, "solver": request.solver, "state": state})

    def _renew(self, held: Lease, progress: Progress | None) -> Order:
        report = None if progress is None else dataclasses.asdict(progress)
        try:
            with self._database.transaction() as session:
                state = lease.renew(session, held, lease_s=self._settings.lease_s, progress=report)
        except SQLAlchemyError as error:
            _raise_unless_it_passes(error, "could not renew a lease")
            return Order.GO_ON
        if state is None:
            return Order.ABANDON
        return Order.CANCEL if state == "cancelling" else Order.GO_ON

    def _conclude(
        self, held: Lease, request: PlanRequest, ending: Ending | Abandoned | Lost
    ) -> str:
        """Write how a run ended, and return it as one word."""
        if isinstance(ending, Lost):
            self._persist(lambda session: lease.let_go(session, held))
            # Start a new fork server before the lease of the next job runs.
            self._runner.warm_up(lambda: not self._is_stopping())
            return "lost"
        if isinstance(ending, Abandoned):
            self._persist(lambda session: lease.hand_back(session, self._queue, held))
            return "abandoned"
        if isinstance(ending, Answered):
            self._share(request.scenario_sha256, ending.answer)
        outcome = outcome_of(ending)
        if not self._persist(lambda session: lease.finish(session, held, outcome)):
            log.warning("a job went on without this worker", extra={"job_id": held.job_id})
        return outcome.state

    def _share(self, sha256: str, answer: PlanAnswer) -> None:
        """Store what other jobs of the scenario need not compute again."""
        chunk, bound, proof = answer.opportunity_block, answer.bound, answer.proof
        if chunk is not None:
            self._persist(lambda session: opportunity_store.save(session, sha256, chunk))
        # A cancelled job has not waited for a good bound; the next job shall look for one.
        if bound is not None and proof is not None and answer.termination != "cancelled":
            self._persist(lambda session: bound_store.save(session, sha256, bound, proof))

    def _persist(self, write: Callable[[Session], T]) -> T:
        """Write in one transaction, repeated while the database is away."""
        return self._insist(self._database.transaction, write)

    def _insist(
        self, begin: Callable[[], AbstractContextManager[Session]], work: Callable[[Session], T]
    ) -> T:
        """Do the work of one transaction, repeated while the database is away."""
        while True:
            try:
                with begin() as session:
                    return work(session)
            except SQLAlchemyError as error:
                if self._is_stopping():
                    raise
                _raise_unless_it_passes(error, "a transaction failed; trying again")
                self._stopping.wait(_RETRY_S)

    def _enrol(self) -> None:
        with self._database.transaction() as session:
            forgotten = WorkerRow.seen_at < utc_now(-_FORGET_WORKER_S)
            session.execute(sa.delete(WorkerRow).where(forgotten))
            row = {"id": self.id, "started_at": utc_now(), "seen_at": utc_now()}
            session.execute(sa.insert(WorkerRow).values(**row))

    def _look_after_others(self) -> None:
        try:
            with self._database.transaction() as session:
                mine = sa.update(WorkerRow).where(WorkerRow.id == self.id)
                session.execute(mine.values(seen_at=utc_now()))
            self._reconciler.run()
            self._retention.run()
        except Exception:
            log.warning("could not look for stranded jobs", exc_info=True)

    def _leave(self) -> None:
        try:
            with self._database.transaction() as session:
                session.execute(sa.delete(WorkerRow).where(WorkerRow.id == self.id))
        except SQLAlchemyError as error:
            _raise_unless_it_passes(error, "could not deregister")
        self._queue.close()
        self._database.close()
        remove_folder(self._held_in)


def outcome_of(ending: Ending) -> Outcome:
    """Return the outcome of the job for a run's ending."""
    if isinstance(ending, Refused):
        return Outcome.failed(ending.code, ending.detail)
    if isinstance(ending, Stopped):
        return Outcome(state="cancelled")
    answer = ending.answer
    return Outcome(
        state="cancelled" if answer.termination == "cancelled" else "succeeded",
        termination=answer.termination,
        progress=dataclasses.asdict(
            Progress(phase="verify", fraction=1.0, reward=answer.reward, bound=answer.bound)
        ),
        chunks=(*answer.chunks, *proof_chunks(answer.proof or "")),
        figures=answer.figures,
        warnings=answer.warnings,
        num_shared_bytes=len(answer.opportunity_block or b""),
    )


def _request(
    session: Session, job_id: str, run: int, held_in: Path | None
) -> tuple[PlanRequest, JobRow]:
    """Return the request for the solver's process, and its job."""
    wanted = (
        sa.select(JobRow, ScenarioRow.sha256, ScenarioRow.content)
        .join(ScenarioRow, ScenarioRow.id == JobRow.scenario_id)
        .where(JobRow.id == job_id)
    )
    job, sha256, content = session.execute(wanted).one()
    request = PlanRequest(
        job_id=job.id,
        run=run,
        scenario_sha256=sha256,
        content=content,
        solver=job.solver,
        params=job.params,
        seed=job.seed,
        limits=job.limits,
        opportunity_block=Parcel(opportunity_store.load(session, sha256)),
        bound=bound_store.load(session, sha256),
        parent=_parent(session, job, held_in),
        held_in=None if held_in is None else str(held_in),
    )
    return request, job


def _parent(session: Session, job: JobRow, held_in: Path | None) -> Parent | None:
    """Return the parent plan of a replan; without its opportunities if the worker holds them."""
    plan_id = (job.change or {}).get("replan_of")
    wanted = (
        sa.select(ScenarioRow.sha256, ScenarioRow.content)
        .join(JobRow, JobRow.scenario_id == ScenarioRow.id)
        .join(PlanRow, PlanRow.job_id == JobRow.id)
        .where(PlanRow.id == plan_id)
    )
    found = None if plan_id is None else session.execute(wanted).one_or_none()
    if found is None:
        return None
    sha256, content = found
    is_held = held_in is not None and HeldBlocks(held_in).holds(sha256)
    imaged = sa.select(PlanActionRow.target_id).where(
        PlanActionRow.plan_id == plan_id, PlanActionRow.target_id.is_not(None)
    )
    return Parent(
        scenario_sha256=sha256,
        content=content,
        bound=bound_store.load(session, sha256),
        imaged=frozenset(session.scalars(imaged)),
        opportunity_block=Parcel(None if is_held else opportunity_store.load(session, sha256)),
    )


def _raise_unless_it_passes(error: SQLAlchemyError, consequence: str) -> None:
    why = why_unavailable(error)
    if why is None:
        raise error
    log.warning("%s (%s)", consequence, why, exc_info=True)

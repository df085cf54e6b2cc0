"""The queue: a small port, implemented with DBOS.

A job's row is the truth; the queue only decides where and when a *dispatch* of it runs. A
dispatch is named ``"{job_id}:{dispatch}"``; a name is never used twice.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final, Protocol

import sqlalchemy as sa
from dbos import DBOS, DBOSClient, DBOSConfig, EnqueueOptions
from sqlalchemy.orm import Session

from service.db.postgresql import make_postgresql_engine
from service.db.sqlite_clock import add_sqlite_clock
from service.db.timeouts import DEFAULT_TIMEOUT_S
from service.settings import Settings

add_sqlite_clock()

APPLICATION: Final = "slewline"
QUEUE: Final = "plan"
WORKFLOW: Final = "run_job"
# Pinned: if each release had its own version, it would not see the jobs of the one before.
VERSION: Final = "1"
# Priority of a job; in the queue itself, a lower number is more urgent.
MOST_URGENT: Final = 9

# DBOS logs at length when it starts.
logging.getLogger("dbos").setLevel(logging.WARNING)


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A dispatch that a worker has taken from the queue and that has not ended yet."""

    job_id: str
    dispatch: int
    claimed_at: datetime


class JobQueue(Protocol):
    """What the service needs from a queue."""

    def enqueue(
        self, session: Session, job_id: str, dispatch: int, *, priority: int, tenant: str
    ) -> None:
        """Add a dispatch within the caller's transaction. Higher ``priority`` runs sooner."""
        ...

    def cancel(self, job_id: str, dispatch: int) -> None:
        """Remove a dispatch. Opens its own transaction: call it after yours has ended."""
        ...

    def claims(self) -> list[Claim]:
        """Return the dispatches taken by workers, dead or alive."""
        ...

    def lost(self, dispatches: Iterable[tuple[str, int]]) -> set[tuple[str, int]]:
        """Return the given dispatches that neither wait nor run any more."""
        ...


def dispatch_name(job_id: str, dispatch: int) -> str:
    """Return the queue's name for one dispatch of a job."""
    return f"{job_id}:{dispatch}"


def parse_dispatch_name(name: str) -> tuple[str, int]:
    """Return the job id and dispatch number in a name made by ``dispatch_name``."""
    job_id, _, dispatch = name.rpartition(":")
    return job_id, int(dispatch)


def make_queue_engine(database_url: str, timeout_s: float = DEFAULT_TIMEOUT_S) -> sa.Engine | None:
    """Return the engine DBOS must use, or None if its own will do (SQLite)."""
    if sa.make_url(database_url).get_backend_name() == "sqlite":
        return None
    engine = make_postgresql_engine(database_url, timeout_s, pool_size=10)
    sa.event.listen(engine, "handle_error", _mark_disconnect)
    return engine


def _mark_disconnect(context: sa.engine.ExceptionContext) -> None:
    # DBOS recognizes a lost connection by words that psycopg no longer uses ("connection is bad"),
    # and then gives up writing an outcome. It does honour SQLAlchemy's own flag.
    import psycopg

    error = context.original_exception
    if isinstance(error, psycopg.OperationalError) and error.sqlstate != "57014":
        context.is_disconnect = True


def migrate_queue(settings: Settings) -> None:
    """Create or update the queue's own tables and register the queue."""
    DBOS.migrate(settings.database_url)
    with closing(DbosQueue(settings.database_url, settings.database_timeout_s)) as queue:
        queue.configure(tenant_limit=settings.max_running_per_tenant, poll_s=settings.queue_poll_s)


class DbosQueue:
    """The queue in the service's own database, implemented with DBOS.

    Parameters
    ----------
    database_url
        A database on which ``migrate_queue`` has been run.
    timeout_s
        Time limit of a statement on PostgreSQL.
    """

    def __init__(self, database_url: str, timeout_s: float = DEFAULT_TIMEOUT_S):
        self._engine = make_queue_engine(database_url, timeout_s)
        self._client = DBOSClient(
            system_database_url=database_url,
            system_database_engine=self._engine,
            application_name=APPLICATION,
            retry_connection_errors=False,
            lazy=True,
        )

    def configure(self, *, tenant_limit: int, poll_s: float) -> None:
        """Configure the queue: one job per worker, ``tenant_limit`` at once per tenant."""
        self._client.register_queue(
            QUEUE,
            worker_concurrency=1,
            partition_concurrency=tenant_limit,
            polling_interval_sec=poll_s,
        )

    def enqueue(
        self, session: Session, job_id: str, dispatch: int, *, priority: int, tenant: str
    ) -> None:
        """Add a dispatch within the caller's transaction."""
        options = EnqueueOptions(
            workflow_name=WORKFLOW,
            queue_name=QUEUE,
            workflow_id=dispatch_name(job_id, dispatch),
            priority=1 + MOST_URGENT - priority,
            queue_partition_key=tenant,
            app_version=VERSION,
            application_name=APPLICATION,
        )
        self._client.enqueue_in_transaction(session, options, job_id, dispatch)

    def cancel(self, job_id: str, dispatch: int) -> None:
        """Take a dispatch from the queue, or free the slot of a claimed one."""
        self._client.cancel_workflow(dispatch_name(job_id, dispatch))

    def claims(self) -> list[Claim]:
        """Return the dispatches taken by workers, dead or alive."""
        found = self._client.list_workflows(
            status="PENDING", queue_name=QUEUE, load_input=False, load_output=False
        )
        claims = []
        for workflow in found:
            job_id, dispatch = parse_dispatch_name(workflow.workflow_id)
            claimed_at = datetime.fromtimestamp((workflow.dequeued_at or 0) / 1000.0, UTC)
            claims.append(Claim(job_id=job_id, dispatch=dispatch, claimed_at=claimed_at))
        return claims

    def lost(self, dispatches: Iterable[tuple[str, int]]) -> set[tuple[str, int]]:
        """Return the given dispatches that neither wait nor run any more."""
        asked = set(dispatches)
        alive = self._client.list_workflows(
            workflow_ids=[dispatch_name(*each) for each in asked],
            status=["ENQUEUED", "DELAYED", "PENDING"],
            load_input=False,
            load_output=False,
        )
        return asked - {parse_dispatch_name(workflow.workflow_id) for workflow in alive}

    def close(self) -> None:
        """Close the connections."""
        self._client.destroy()
        if self._engine is not None:
            self._engine.dispose()


class DbosConsumer:
    """The worker's side of the queue: calls ``handle(job_id, dispatch)`` for what it claims.

    Only one may exist per process. ``handle`` runs in a thread of its own, one call at a time.

    Parameters
    ----------
    executor_id
        Must be new: DBOS would restart the dispatches of an earlier worker with the same id.
    """

    def __init__(
        self,
        database_url: str,
        executor_id: str,
        handle: Callable[[str, int], None],
        timeout_s: float = DEFAULT_TIMEOUT_S,
    ):
        self._engine = make_queue_engine(database_url, timeout_s)
        config = DBOSConfig(
            name=APPLICATION,
            system_database_url=database_url,
            system_database_engine=self._engine,
            executor_id=executor_id,
            application_version=VERSION,
            run_migrations=False,
            log_level="WARNING",
        )
        DBOS(config=config)

        @DBOS.workflow(name=WORKFLOW)
        def run_job(job_id: str, dispatch: int) -> None:
            handle(job_id, dispatch)

    def start(self) -> None:
        """Begin to claim dispatches."""
        DBOS.listen_queues([QUEUE])
        DBOS.launch()

    def stop(self) -> None:
        """Claim no more dispatches, and close the database connections."""
        DBOS.destroy(destroy_registry=True)
        if self._engine is not None:
            self._engine.dispose()

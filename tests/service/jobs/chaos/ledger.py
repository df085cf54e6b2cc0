"""The outcome of every job, compared with what was promised."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import sqlalchemy as sa

from service.answers.chunks import head_in
from service.db.rows import JobChunkRow, JobRow
from service.wire.jobs import FINAL
from tests.service.jobs.conftest import Jobs

_ENDINGS = sa.table("ending", sa.column("job_id"))
_STATES = ", ".join(f"'{state}'" for state in FINAL)

# One entry each time a job's state becomes final, by whatever process and way.
_SQLITE = (
    "CREATE TABLE ending (job_id TEXT)",
    f"CREATE TRIGGER note_ending AFTER UPDATE OF state ON job WHEN new.state IN ({_STATES})"
    " BEGIN INSERT INTO ending VALUES (new.id); END",
)
_POSTGRESQL = (
    "CREATE TABLE ending (job_id TEXT)",
    "CREATE FUNCTION note_ending() RETURNS trigger LANGUAGE plpgsql AS"
    " 'BEGIN INSERT INTO ending VALUES (new.id); RETURN NULL; END'",
    "CREATE TRIGGER note_ending AFTER UPDATE OF state ON job FOR EACH ROW"
    f" WHEN (new.state IN ({_STATES})) EXECUTE FUNCTION note_ending()",
)


@dataclass(frozen=True, slots=True)
class Ended:
    """A job at the end, with the run that produced its answer (None without an answer)."""

    job: JobRow
    endings: int
    answered_by_run: int | None


def open_ledger(jobs: Jobs) -> None:
    """Let the database itself count how often each job ends."""
    is_sqlite = jobs.database.engine.dialect.name == "sqlite"
    with jobs.database.transaction() as session:
        for statement in _SQLITE if is_sqlite else _POSTGRESQL:
            session.execute(sa.text(statement))


def num_unfinished(jobs: Jobs) -> int:
    """Return how many jobs have not ended yet."""
    unfinished = sa.select(sa.func.count(JobRow.id)).where(JobRow.state.not_in(FINAL))
    with jobs.database.reading() as session:
        return session.execute(unfinished).scalar_one()


def read_ledger(jobs: Jobs) -> list[Ended]:
    """Return all jobs, in the order in which they ended."""
    with jobs.database.reading() as session:
        counted = session.execute(
            sa.select(_ENDINGS.c.job_id, sa.func.count()).group_by(_ENDINGS.c.job_id)
        )
        endings = {job_id: number for job_id, number in counted}  # noqa: C416 - rows are no pairs
        heads = sa.select(JobChunkRow.job_id, JobChunkRow.text).where(JobChunkRow.kind == "head")
        runs = {row.job_id: head_in(row.text)["run"] for row in session.execute(heads)}
        rows = session.scalars(sa.select(JobRow).order_by(JobRow.finished_at))
        return [Ended(job, endings.get(job.id, 0), runs.get(job.id)) for job in rows]


def check(jobs: Jobs, ended: list[Ended], promised: Mapping[str, str]) -> None:
    """Compare the jobs with what was promised: each job's final state, by its id."""
    found = {entry.job.id for entry in ended}
    assert found == set(promised), "jobs were lost, or came from nowhere"
    for entry in ended:
        job = entry.job
        assert job.state == promised[job.id], (job.id, job.state, job.error)
        assert entry.endings == 1, f"job {job.id} ended {entry.endings} times"
        if job.state == "succeeded":
            assert entry.answered_by_run == job.run, f"job {job.id} has a stale run's answer"
        assert job.lease_until is None
    dispatches = {(e.job.id, number) for e in ended for number in range(1, e.job.dispatch + 1)}
    jobs.until(lambda: jobs.queue.claims() == [])
    assert jobs.queue.lost(dispatches) == dispatches, "the queue still holds dispatches"


def check_shares(ended: list[Ended], giant: str) -> None:
    """Check that each tenant has an answer by the time half of the giant's are there."""
    order = [entry.job.tenant for entry in ended]
    of_giant = [place for place, tenant in enumerate(order) if tenant == giant]
    served = set(order[: of_giant[len(of_giant) // 2]])
    assert served == set(order), f"served: {served}"


def figures(ended: list[Ended], faults: Counter[str], seconds: float) -> str:
    """Return what happened, as text."""
    lost = sum(entry.job.lost_runs for entry in ended)
    runs = sum(entry.job.run for entry in ended)
    lines = [
        f"{len(ended)} jobs in {seconds:.0f} s: {runs} runs begun, {lost} of them lost",
        "faults: " + ", ".join(f"{name} {number}" for name, number in sorted(faults.items())),
    ]
    for tenant in sorted({entry.job.tenant for entry in ended}):
        own = [entry.job for entry in ended if entry.job.tenant == tenant]
        states = Counter(job.state for job in own)
        waits_s = [(j.finished_at - j.created_at).total_seconds() for j in own if j.finished_at]
        told = ", ".join(f"{number} {state}" for state, number in sorted(states.items()))
        lines.append(f"  {tenant}: {told}; the longest took {max(waits_s):.1f} s from its POST")
    return "\n".join(lines)

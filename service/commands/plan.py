"""What ``slewline plan`` and ``replan`` share: a job to the service, its plan back."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from service.client import Client, Job, JobFailed, ServiceError
from service.commands.progress_line import ProgressLine
from service.commands.summary import summary


def follow_to_plan(
    client: Client,
    submit: Callable[[], Job],
    *,
    out: Path | None,
    detach: bool,
    tell: Callable[[Job], None] = lambda _: None,
) -> int:
    """Submit a job, follow it, print a summary of its plan; return 0 where that is valid, else 1.

    Ctrl-C cancels the job and saves the best plan that it had; a second one leaves at once.

    Parameters
    ----------
    submit
        Posts the job under a key of its own: asked twice, it is the same job.
    out
        Where to save the timeline; the suffix chooses its form.
    detach
        Whether to print the job's id and leave it to itself.
    tell
        Prints what else there is to say of a job that has a plan.

    Raises
    ------
    ClientError
        Where the service refuses, fails or does not answer.
    OSError
        Where the timeline cannot be written.
    """
    try:
        job = submit()
    except KeyboardInterrupt:
        # It may have been taken already: under the same key that very job is answered.
        _cancel(submit())
        raise
    if detach:
        print(job.id)
        return 0
    print(f"job {job.id} at {client.url}", file=sys.stderr)
    job = _followed(job)
    if job.state in ("failed", "expired"):
        raise JobFailed(job)
    timeline = job.timeline()
    print(summary(timeline.model_dump()))
    tell(job)
    if out is not None:
        job.download(out)
    return 0 if timeline.validity != "violations" else 1


def _followed(job: Job) -> Job:
    """Return the job at its end."""
    with ProgressLine(sys.stderr) as line:
        try:
            return _watched(job, line)
        except KeyboardInterrupt:
            return _watched(_cancel(job), line)


def _watched(job: Job, line: ProgressLine) -> Job:
    for state in job.follow():
        line.show(state)
        job = state
    return job


def _cancel(job: Job) -> Job:
    with suppress(ServiceError):  # it may have ended by itself: what follows will tell
        return job.cancel()
    return job

"""Jobs: submit one, follow it, read its answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import PrivateAttr

from service.client.collection import Collection
from service.client.errors import JobFailed
from service.client.following import follow, polled
from service.client.transport import parsed, path_of, said
from service.wire.base import Json
from service.wire.jobs import JobOut
from service.wire.outcomes import ExplanationOut as Explanation
from service.wire.outcomes import TargetItem as TargetOutcome
from service.wire.plan_diffs import DiffOut as PlanDiff
from service.wire.scenarios import ScenarioOut as Scenario
from service.wire.timelines import TimelineOut as Timeline

_OPENMCT = ".openmct.json"


class Job(JobOut):
    """A job as it stood when it was read; methods that ask the service return a new one."""

    _jobs: Jobs = PrivateAttr()

    def refresh(self) -> Job:
        """Return the job in its current state."""
        return self._jobs.get(self.id, known=self)

    def follow(self) -> Iterator[Job]:
        """Yield the job as it is, then after each change, until it is final."""
        return self._jobs.follow(self.id)

    def wait(self, timeout_s: float | None = None) -> Job:
        """Return the job when it has succeeded or was cancelled.

        Raises
        ------
        JobFailed
            If it ends in any other way.
        WaitTimedOut
            If it is not final after ``timeout_s``.
        """
        return self._jobs.wait(self.id, timeout_s)

    def cancel(self) -> Job:
        """Ask for its end; the best plan so far is kept."""
        return self._jobs.cancel(self.id)

    def rerun(self) -> Job:
        """Queue the same job again."""
        return self._jobs.rerun(self.id)

    def timeline(self) -> Timeline:
        """Return its plan as judged by the referee."""
        return self._jobs.timeline(self.id)

    def download(self, file: Path | str) -> Path:
        """Write its timeline to a file, in the format of the file's suffix."""
        return self._jobs.download(self.id, file)

    def targets(
        self, *, outcome: str | None = None, reason: str | None = None
    ) -> Iterator[TargetOutcome]:
        """Yield each target of the scenario with its outcome."""
        return self._jobs.targets(self.id, outcome=outcome, reason=reason)

    def explanation(self, target_id: str) -> Explanation:
        """Return why a target is or is not in its plan, opportunity by opportunity."""
        return self._jobs.explanation(self.id, target_id)

    def what_if(self, **change: Any) -> Job:
        """Queue the same job with a change; see ``Jobs.what_if``."""
        return self._jobs.what_if(self.id, **change)


class Jobs(Collection[Job]):
    """The jobs of the service. Deleting a finished one deletes its answer too, for good."""

    _name, _shape = "jobs", Job

    def submit(
        self,
        scenario: str | Scenario | Mapping[str, Any],
        solver: str,
        *,
        params: Mapping[str, Any] | None = None,
        seed: int = 0,
        time_s: float | None = None,
        memory_mb: int | None = None,
        priority: int | None = None,
        label: str | None = None,
        idempotency_key: str | None = None,
    ) -> Job:
        """Queue one job, even if the request has to be sent several times.

        Parameters
        ----------
        scenario
            A stored scenario or its id; or the content of a scenario file or the body of a
            scenario, which is stored with the job (only once if it was sent before).
        params
            Parameters of the solver; defaults for those left out.
        time_s, memory_mb
            The job's limits.
        priority
            0 to 9; 9 is the most urgent.
        """
        body = question(scenario, time_s, memory_mb, priority, label)
        body |= {"solver": solver, "params": dict(params or {}), "seed": seed}
        return self._own(self._create(body, idempotency_key))

    def list(
        self,
        *,
        state: str | None = None,
        solver: str | None = None,
        scenario_id: str | None = None,
        label: str | None = None,
        satellite_id: str | None = None,
        station_id: str | None = None,
    ) -> Iterator[Job]:
        """Yield the jobs, newest first."""
        jobs = self._listed(
            state=state, solver=solver, scenario_id=scenario_id, label=label,
            satellite_id=satellite_id, station_id=station_id,
        )  # fmt: skip
        return map(self._own, jobs)

    def get(self, job_id: str, /, *, known: Job | None = None) -> Job:
        """Return one job; ``known`` itself if nothing has changed since it was read."""
        etag = known.etag if known else None
        headers = {} if etag is None else {"If-None-Match": etag}
        answer = self._transport.request("GET", self._path(job_id), headers=headers)
        if known is not None and answer.status_code == 304:
            return known
        return self._read(answer.text, answer.headers.get("etag"))

    def follow(self, job_id: str) -> Iterator[Job]:
        """Yield the job as it is, then after each change, until it is final."""
        return follow(self._transport, self._path(job_id), self._read)

    def wait(self, job_id: str, timeout_s: float | None = None) -> Job:
        """Return the job when it has succeeded or was cancelled; see ``Job.wait``."""
        path = self._path(job_id)
        # A stream of events may last for ever: only polling can keep a time limit.
        states = (
            self.follow(job_id)
            if timeout_s is None
            else polled(self._transport, path, self._read, timeout_s=timeout_s)
        )
        job = deque(states, maxlen=1).pop()
        if job.state in ("failed", "expired"):
            raise JobFailed(job)
        return job

    def cancel(self, job_id: str) -> Job:
        """Ask for a job's end. Not resent if the answer is lost: look at the job then."""
        answer = self._transport.request("POST", self._path(job_id, "cancel"))
        return self._read(answer.text, answer.headers.get("etag"))

    def rerun(self, job_id: str, *, idempotency_key: str | None = None) -> Job:
        """Queue the same job again."""
        return self._queue(self._path(job_id, "rerun"), idempotency_key)

    def replan(
        self, plan_id: str, happened: Mapping[str, Any], *, idempotency_key: str | None = None
    ) -> Job:
        """Queue the plan that follows another one; see ``Plans.replan``."""
        path = path_of("plans", plan_id, "replans")
        return self._queue(path, idempotency_key, json=dict(happened))

    def timeline(self, job_id: str) -> Timeline:
        """Return a job's plan as judged by the referee; ``not_ready`` before there is one."""
        return self._transport.get(self._path(job_id, "timeline"), Timeline)

    def download(self, job_id: str, file: Path | str) -> Path:
        """Write a timeline to a file, in the format of its suffix.

        The file appears when it is complete; an existing file stays until then.
        """
        to = Path(file)
        suffix = _OPENMCT if to.name.lower().endswith(_OPENMCT) else to.suffix.lower()
        name = f"timeline{suffix or '.json'}"
        self._transport.save(self._path(job_id, name), to)
        return to

    def targets(
        self, job_id: str, *, outcome: str | None = None, reason: str | None = None
    ) -> Iterator[TargetOutcome]:
        """Yield each target of the scenario with its outcome."""
        params = {"outcome": outcome, "reason": reason, "limit": 500}
        return self._transport.pages(self._path(job_id, "targets"), TargetOutcome, params)

    def explanation(self, job_id: str, target_id: str) -> Explanation:
        """Return why a target is or is not in a plan, opportunity by opportunity."""
        path = self._path(job_id, "targets", target_id, "explanation")
        return self._transport.get(path, Explanation)

    def what_if(
        self,
        job_id: str,
        *,
        force: Sequence[str | Mapping[str, Any]] = (),
        forbid: Sequence[str | Mapping[str, Any]] = (),
        relax: Mapping[str, Any] | None = None,
        idempotency_key: str | None = None,
        **other: Any,
    ) -> Job:
        """Queue a job again with a change.

        Parameters
        ----------
        force, forbid
            Ids of targets, or actions as in ``pins``.
        relax
            New values of settings; the ``change`` of a reason can be used.
        other
            ``solver``, ``params``, ``seed``, ``limits``, ``priority``, ``label``, if they
            differ from those of the job.
        """
        body = {"force": list(force), "forbid": list(forbid), "relax": dict(relax or {}), **other}
        return self._queue(self._path(job_id, "what-if"), idempotency_key, json=body)

    def diff(self, before: str | Job, after: str | Job) -> PlanDiff:
        """Return the actions that only one of the plans of two jobs has."""
        first, second = (job.id if isinstance(job, Job) else job for job in (before, after))
        return self._transport.get(self._path(first, "diff", second), PlanDiff)

    def _queue(self, path: str, idempotency_key: str | None, **body: Any) -> Job:
        return self._own(self._transport.post(path, Job, idempotency_key=idempotency_key, **body))

    def _read(self, text: str, etag: str | None = None) -> Job:
        return self._own(parsed(Job, text, "a job").with_etag(etag))

    def _own(self, job: Job) -> Job:
        job._jobs = self
        return job


def question(
    scenario: str | Scenario | Mapping[str, Any],
    time_s: float | None,
    memory_mb: int | None,
    priority: int | None,
    label: str | None,
) -> Json:
    """Return the part of the body that jobs and comparisons share, without fields that are None."""
    if isinstance(scenario, Mapping):
        asked: Json = {"scenario": dict(scenario)}
    else:
        asked = {"scenario_id": scenario.id if isinstance(scenario, Scenario) else scenario}
    asked["limits"] = said(time_s=time_s, memory_mb=memory_mb)
    return asked | said(priority=priority, label=label)

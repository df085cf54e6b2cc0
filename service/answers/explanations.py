"""One target explained in detail: every opportunity, and what would give it one."""

from __future__ import annotations

from datetime import datetime

import planner_core
from planner_core.budget import Budget
from planner_core.reasons.access_changes import OF_TARGETS, AccessChange, access_changes
from planner_core.reasons.at_length import Attempt, explain_target
from service.answers.rebuilt import Rebuilt, rebuild
from service.answers.rendering import Wording
from service.scenarios.background import Background
from service.scenarios.opportunities import Described
from service.wire.base import Json, read
from service.wire.instants import instant_text
from service.wire.outcomes import AttemptOut, ExplanationOut
from service.wire.timelines import TimelineOut

_KEPT_JOBS = 2


class Explainer(Background):
    """Explains targets in the background; the most recent jobs stay compiled."""

    _kept, _told = 200, "The explanation is being computed."

    def __init__(self) -> None:
        super().__init__()
        # Used only by the background's thread.
        self._jobs: dict[str, Rebuilt] = {}

    def get(self, job_id: str, described: Described, timeline: str, target: int) -> ExplanationOut:
        """Return the explanation of a target; 503 ``still_computing`` if it takes long."""

        def work(budget: Budget) -> ExplanationOut:
            job = self._jobs.pop(job_id, None) or rebuild(
                described, read(TimelineOut, timeline), budget
            )
            self._jobs[job_id] = job
            for oldest in list(self._jobs)[:-_KEPT_JOBS]:
                del self._jobs[oldest]
            return _Words(job).explanation(target, budget)

        return self.work_out(f"{job_id}/{target}", work)


def version_of(job_id: str, target_id: str) -> str:
    """Return what identifies an explanation: it depends only on the job and this version."""
    return f"{planner_core.__version__}/{job_id}/{target_id}"


class _Words(Wording):
    def __init__(self, job: Rebuilt):
        super().__init__(job.scenario, job.problem, job.timeline)
        self.job = job

    def explanation(self, target: int, budget: Budget) -> ExplanationOut:
        job = self.job
        found = explain_target(job.problem, job.plan, job.timeline, target, job.search)
        reason = found.outcome.reason
        is_hidden = reason is not None and reason.code == "no_access"
        changes = access_changes(job.scenario, target, budget) if is_hidden else ()
        return ExplanationOut(
            **dict(self.target(found.outcome)),
            opportunities=[self._attempt(attempt) for attempt in found.attempts],
            access_changes=[self._access_change(target, change) for change in changes],
        )

    def _attempt(self, attempt: Attempt) -> AttemptOut:
        return AttemptOut(
            opportunity_id=f"o{attempt.scenario_row}",
            satellite_id=self.problem.satellites[attempt.satellite].id,
            satellite_name=self.problem.satellites[attempt.satellite].name,
            start=self.instant(attempt.start_s),
            end=self.instant(attempt.end_s),
            violations=[self.violation(violation) for violation in attempt.violations],
            displaces=[self.action_ids[p] for p in attempt.displaces],
            fits_instead=attempt.is_settled,
            reward_delta=attempt.reward_delta,
            ruled_out=attempt.ruled_out,
        )

    def _access_change(self, target: int, change: AccessChange) -> Json:
        """Return a change in the form of a what-if's ``relax``."""
        satellite, own = self.scenario.satellites[change.satellite], self.scenario.targets[target]
        said: Json = {"satellite_id": satellite.id}
        setting: Json = {change.setting: change.value}
        if isinstance(change.value, datetime):
            setting = {change.setting: instant_text(change.value)}
        if change.setting == "horizon_end":
            return said | setting
        if change.setting in OF_TARGETS:
            return said | {"targets": {own.id: setting}}
        if _is_narrower(getattr(satellite.sensor, change.setting), change):
            said |= setting
        if _is_narrower(getattr(own, change.setting), change):
            said["targets"] = {own.id: setting}
        return said


def _is_narrower(limit: object, change: AccessChange) -> bool:
    """Return whether a limit is tighter than what the change needs."""
    if isinstance(limit, float | int) and isinstance(change.value, float):
        return limit < change.value if "_max" in change.setting else limit > change.value
    return limit is not None and limit != change.value

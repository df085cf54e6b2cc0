"""Plans in operations: drafts that are approved, published and reported on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any, Literal

from service.client.collection import Collection
from service.client.jobs import Job, Jobs
from service.client.transport import Transport, in_text, only_if, said
from service.client.uploads import upload
from service.wire.passes import PassOut as Pass
from service.wire.plans import ExecutionOut as Execution
from service.wire.plans import PlanActionOut as PlanAction
from service.wire.plans import PlanEventOut as PlanEvent
from service.wire.plans import PlanOut as Plan
from service.wire.plans import PlanStateOut as PlanState
from service.wire.plans import ReportedOut, StatesReportedOut
from service.wire.replans import PlanChangesOut as PlanChanges

At = datetime | Literal["now"]


class Plans(Collection[Plan]):
    """The plans of the key's owner. Deletion is final; approved and published ones are refused."""

    _name, _shape = "plans", Plan

    def __init__(self, transport: Transport, jobs: Jobs):
        super().__init__(transport)
        self._jobs = jobs

    def create(
        self, job_id: str, *, name: str | None = None, idempotency_key: str | None = None
    ) -> Plan:
        """Take a job's plan into operations, as a draft."""
        return self._create(said(job_id=job_id, name=name), idempotency_key)

    def list(
        self,
        *,
        state: str | None = None,
        satellite_id: str | None = None,
        at: At | None = None,
        job_id: str | None = None,
        parent_id: str | None = None,
    ) -> Iterator[Plan]:
        """Yield plans, newest first; with ``state="published", at="now"`` those in force."""
        return self._listed(
            state=state, satellite_id=satellite_id, at=at, job_id=job_id, parent_id=parent_id
        )

    def approve(
        self,
        plan_id: str,
        *,
        reason: str | None = None,
        waivers: Mapping[str, str] | None = None,
        if_match: str | None = None,
    ) -> Plan:
        """Approve a draft; ``waivers`` gives a reason for each of its violations."""
        told = [{"violation": each, "reason": why} for each, why in (waivers or {}).items()]
        return self._move(plan_id, "approved", if_match, reason=reason, waivers=told or None)

    def publish(
        self,
        plan_id: str,
        *,
        reason: str | None = None,
        effective_from: datetime | None = None,
        if_match: str | None = None,
    ) -> Plan:
        """Put an approved plan in force, replacing the plans in force for its satellites."""
        told = {"reason": reason, "effective_from": effective_from}
        return self._move(plan_id, "published", if_match, **told)

    def withdraw(
        self, plan_id: str, *, reason: str | None = None, if_match: str | None = None
    ) -> Plan:
        """Take a plan out of operations."""
        return self._move(plan_id, "withdrawn", if_match, reason=reason)

    def history(self, plan_id: str) -> Iterator[PlanEvent]:
        """Yield the plan's transitions in order."""
        return self._transport.pages(self._path(plan_id, "history"), PlanEvent)

    def actions(self, plan_id: str, *, satellite_id: str | None = None) -> Iterator[PlanAction]:
        """Yield the plan's collects and contacts, with their reported outcomes."""
        wanted = {"satellite_id": satellite_id}
        return self._transport.pages(self._path(plan_id, "actions"), PlanAction, wanted)

    def passes(
        self,
        plan_id: str,
        *,
        station_id: str | None = None,
        satellite_id: str | None = None,
        from_: datetime | None = None,
        to: datetime | None = None,
        planned: bool | None = None,
    ) -> Iterator[Pass]:
        """Yield the passes over the plan's stations in order of AOS, planned or not."""
        wanted = {
            "station_id": station_id, "satellite_id": satellite_id,
            "from": from_, "to": to, "planned": planned,
        }  # fmt: skip
        return self._transport.pages(self._path(plan_id, "passes"), Pass, wanted)

    def report(
        self,
        plan_id: str,
        executions: Iterable[Mapping[str, Any]],
        *,
        idempotency_key: str | None = None,
    ) -> Sequence[Execution]:
        """Report outcomes of actions: ``{"action_id": …, "outcome": "executed"}``, and so on."""
        return self._report(plan_id, idempotency_key, json=[dict(each) for each in executions])

    def report_csv(
        self, plan_id: str, data: bytes, *, idempotency_key: str | None = None
    ) -> Sequence[Execution]:
        """Report outcomes of actions, as a table with a header."""
        return self._report(plan_id, idempotency_key, **upload(data, "csv"))

    def add_states(
        self,
        plan_id: str,
        states: Iterable[Mapping[str, Any]],
        *,
        idempotency_key: str | None = None,
    ) -> Sequence[PlanState]:
        """Add telemetry: ``{"satellite_id": …, "at": …, "battery_fraction": 0.8}``, and so on."""
        return self._add_states(plan_id, idempotency_key, json=list(map(in_text, states)))

    def add_states_csv(
        self, plan_id: str, data: bytes, *, idempotency_key: str | None = None
    ) -> Sequence[PlanState]:
        """Add telemetry, as a table with a header."""
        return self._add_states(plan_id, idempotency_key, **upload(data, "csv"))

    def states(self, plan_id: str) -> Iterator[PlanState]:
        """Yield the telemetry of a plan, newest first."""
        return self._transport.pages(self._path(plan_id, "states"), PlanState)

    def executions(self, plan_id: str) -> Iterator[Execution]:
        """Yield the reported outcomes, newest first."""
        return self._transport.pages(self._path(plan_id, "executions"), Execution)

    def replan(self, plan_id: str, *, idempotency_key: str | None = None, **happened: Any) -> Job:
        """Queue the plan that follows this one; ``happened`` is the body of the request.

        It takes ``freeze_until``, ``outages``, ``promises``, ``add_targets``, ``stability`` and the
        like as in the API; ``now``, ``freeze_until`` and ``horizon_end`` may be aware datetimes.
        When the job has succeeded, its draft is ``draft_of(job)``.
        """
        return self._jobs.replan(plan_id, in_text(happened), idempotency_key=idempotency_key)

    def draft_of(self, job: Job) -> Plan:
        """Return the draft created by a replan's job."""
        return self._transport.get(job.links["plan"], Plan)

    def changes(self, plan_id: str) -> PlanChanges:
        """Return what a replan has changed, and why."""
        return self._transport.get(self._path(plan_id, "changes"), PlanChanges)

    def _move(self, plan_id: str, to: str, if_match: str | None, **fields: Any) -> Plan:
        return self._transport.post(
            self._path(plan_id, "transitions"),
            Plan,
            json=said(to=to, **fields),
            headers=only_if(if_match),
            idempotency_key=None,
        )

    def _report(self, plan_id: str, key: str | None, **body: Any) -> Sequence[Execution]:
        path = self._path(plan_id, "executions")
        return self._transport.post(path, ReportedOut, idempotency_key=key, **body).executions

    def _add_states(self, plan_id: str, key: str | None, **body: Any) -> Sequence[PlanState]:
        path = self._path(plan_id, "states")
        return self._transport.post(path, StatesReportedOut, idempotency_key=key, **body).states

"""Plans with a life: drafts that are approved, published and reported on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any, Final, Literal

from service.client.jobs import Job, Jobs
from service.client.transport import Transport, path_of
from service.wire.instants import instant_text
from service.wire.passes import PassOut as Pass
from service.wire.plans import ExecutionOut as Execution
from service.wire.plans import PlanActionOut as PlanAction
from service.wire.plans import PlanEventOut as PlanEvent
from service.wire.plans import PlanOut as Plan
from service.wire.plans import PlanStateOut as PlanState
from service.wire.plans import ReportedOut, StatesReportedOut
from service.wire.replans import PlanChangesOut as PlanChanges

_CSV: Final = {"Content-Type": "text/csv"}

At = datetime | Literal["now"]


class Plans:
    """The plans of the key's owner."""

    def __init__(self, transport: Transport, jobs: Jobs):
        self._transport = transport
        self._jobs = jobs

    def create(
        self, job_id: str, *, name: str | None = None, idempotency_key: str | None = None
    ) -> Plan:
        """Take a job's plan into operations, as a draft."""
        body = {"job_id": job_id} | ({} if name is None else {"name": name})
        return self._transport.post(
            path_of("plans"), Plan, json=body, idempotency_key=idempotency_key
        )

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
        instant = instant_text(at) if isinstance(at, datetime) else at
        wanted = {"state": state, "satellite_id": satellite_id, "at": instant,
                  "job_id": job_id, "parent_id": parent_id}  # fmt: skip
        params = {name: value for name, value in wanted.items() if value is not None}
        return self._transport.pages(path_of("plans"), Plan, params=params)

    def get(self, plan_id: str) -> Plan:
        """Return one plan."""
        return self._transport.get(path_of("plans", plan_id), Plan)

    def delete(self, plan_id: str) -> None:
        """Delete a plan that is neither approved nor published, for good."""
        self._transport.delete(path_of("plans", plan_id))

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
        """Put an approved plan in force, in place of what is so for its satellites."""
        instant = None if effective_from is None else instant_text(effective_from)
        return self._move(plan_id, "published", if_match, reason=reason, effective_from=instant)

    def withdraw(
        self, plan_id: str, *, reason: str | None = None, if_match: str | None = None
    ) -> Plan:
        """Take a plan out of operations."""
        return self._move(plan_id, "withdrawn", if_match, reason=reason)

    def history(self, plan_id: str) -> Iterator[PlanEvent]:
        """Yield the plan's transitions in their order."""
        return self._transport.pages(path_of("plans", plan_id, "history"), PlanEvent)

    def actions(self, plan_id: str, *, satellite_id: str | None = None) -> Iterator[PlanAction]:
        """Yield the plan's collects and contacts, with what became of them."""
        params = {} if satellite_id is None else {"satellite_id": satellite_id}
        return self._transport.pages(
            path_of("plans", plan_id, "actions"), PlanAction, params=params
        )

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
        """Yield the passes over the plan's stations by AOS, planned or not."""
        wanted = {
            "station_id": station_id,
            "satellite_id": satellite_id,
            "from": None if from_ is None else instant_text(from_),
            "to": None if to is None else instant_text(to),
            "planned": None if planned is None else str(planned).lower(),
        }
        params = {name: value for name, value in wanted.items() if value is not None}
        return self._transport.pages(path_of("plans", plan_id, "passes"), Pass, params=params)

    def report(
        self,
        plan_id: str,
        executions: Iterable[Mapping[str, Any]],
        *,
        idempotency_key: str | None = None,
    ) -> Sequence[Execution]:
        """Report what became of actions: ``{"action_id": …, "outcome": "executed"}``, and so on."""
        told = self._transport.post(
            path_of("plans", plan_id, "executions"), ReportedOut,
            json=[dict(each) for each in executions], idempotency_key=idempotency_key,
        )  # fmt: skip
        return told.executions

    def report_csv(
        self, plan_id: str, data: bytes, *, idempotency_key: str | None = None
    ) -> Sequence[Execution]:
        """Report what became of actions, as a table with a header."""
        told = self._transport.post(
            path_of("plans", plan_id, "executions"), ReportedOut, content=data, headers=_CSV,
            idempotency_key=idempotency_key,
        )  # fmt: skip
        return told.executions

    def add_states(
        self,
        plan_id: str,
        states: Iterable[Mapping[str, Any]],
        *,
        idempotency_key: str | None = None,
    ) -> Sequence[PlanState]:
        """Add telemetry: ``{"satellite_id": …, "at": …, "battery_fraction": 0.8}``, and so on."""
        told = self._transport.post(
            path_of("plans", plan_id, "states"), StatesReportedOut,
            json=[_in_text(each) for each in states], idempotency_key=idempotency_key,
        )  # fmt: skip
        return told.states

    def add_states_csv(
        self, plan_id: str, data: bytes, *, idempotency_key: str | None = None
    ) -> Sequence[PlanState]:
        """Add telemetry, as a table with a header."""
        told = self._transport.post(
            path_of("plans", plan_id, "states"), StatesReportedOut, content=data, headers=_CSV,
            idempotency_key=idempotency_key,
        )  # fmt: skip
        return told.states

    def states(self, plan_id: str) -> Iterator[PlanState]:
        """Yield telemetry of a plan, newest first."""
        return self._transport.pages(path_of("plans", plan_id, "states"), PlanState)

    def executions(self, plan_id: str) -> Iterator[Execution]:
        """Yield what was reported, newest first."""
        return self._transport.pages(path_of("plans", plan_id, "executions"), Execution)

    def replan(self, plan_id: str, *, idempotency_key: str | None = None, **happened: Any) -> Job:
        """Queue the plan that follows this one; ``happened`` is the body of the call.

        ``freeze_until``, ``outages``, ``promises``, ``add_targets``, ``stability`` and the like,
        as the API takes them; ``now``, ``freeze_until`` and ``horizon_end`` may be aware
        datetimes. Once the job has succeeded, the draft is ``draft_of(job)``.
        """
        body = {
            name: instant_text(value) if isinstance(value, datetime) else value
            for name, value in happened.items()
        }
        return self._jobs.replan(plan_id, body, idempotency_key=idempotency_key)

    def draft_of(self, job: Job) -> Plan:
        """Return the draft that the job of a replan has left."""
        return self._transport.get(job.links["plan"], Plan)

    def changes(self, plan_id: str) -> PlanChanges:
        """Return what a replan has changed, and why."""
        return self._transport.get(path_of("plans", plan_id, "changes"), PlanChanges)

    def _move(self, plan_id: str, to: str, if_match: str | None, **fields: Any) -> Plan:
        return self._transport.post(
            path_of("plans", plan_id, "transitions"),
            Plan,
            json={"to": to} | {k: v for k, v in fields.items() if v is not None},
            headers={} if if_match is None else {"If-Match": if_match},
            idempotency_key=None,
        )


def _in_text(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return a state with its instants as text."""
    return {
        name: instant_text(value) if isinstance(value, datetime) else value
        for name, value in state.items()
    }

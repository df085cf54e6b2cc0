"""How far the targets of a catalogue have come, read from plans and what was reported of them.

Nothing of it is stored: a report that comes late, or a plan that is withdrawn, changes it at once.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from service.db.rows import (
    ExecutionRow,
    JobRow,
    PlanActionRow,
    PlanRow,
    PlanSatelliteRow,
    ScenarioRow,
)
from service.wire.stored import from_row
from service.wire.target_lives import TargetCollectOut, TargetState

_TAKEN: Final = ("executed", "partial")
_NOT_DONE: Final = ("failed", "skipped")
_ROUNDING: Final = timedelta(milliseconds=2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lives:
    """What plans and reports say of the targets of one catalogue, by target id.

    Attributes
    ----------
    taken
        The first image of each target that was taken.
    delivered
        The targets with an image that is on the ground.
    planned
        The next image in a published plan of each target.
    """

    taken: Mapping[str, TargetCollectOut] = field(default_factory=dict)
    delivered: frozenset[str] = frozenset()
    planned: Mapping[str, TargetCollectOut] = field(default_factory=dict)

    def state_of(
        self, target_id: str, due: datetime | None, *, is_cancelled: bool, now: datetime
    ) -> TargetState:
        """Return how far a target has come; an image counts for more than what follows it."""
        if target_id in self.delivered:
            return "delivered"
        if target_id in self.taken:
            return "collected"
        if is_cancelled:
            return "cancelled"
        if target_id in self.planned:
            return "planned"
        return "expired" if due is not None and due <= now else "open"

    def collect_of(self, target_id: str) -> TargetCollectOut | None:
        """Return the image that the state rests on."""
        return self.taken.get(target_id) or self.planned.get(target_id)


def plans_by_catalog(session: Session, owner: str | None) -> dict[str, list[str]]:
    """Return the plans that ever were published, by the catalogues that they serve.

    Ids of targets are unique in a scenario, so that a plan and an id say which target it is.
    """
    catalogs = ScenarioRow.summary["target_catalog_ids"]
    wanted = (
        sa.select(PlanRow.id, catalogs)
        .join(JobRow, JobRow.id == PlanRow.job_id)
        .join(ScenarioRow, ScenarioRow.id == JobRow.scenario_id)
        .where(
            sa.exists().where(
                PlanSatelliteRow.plan_id == PlanRow.id, PlanSatelliteRow.in_force_from.is_not(None)
            )
        )
    )
    if owner is not None:
        wanted = wanted.where(PlanRow.owner == owner)
    found: dict[str, list[str]] = defaultdict(list)
    for plan_id, catalog_ids in session.execute(wanted.order_by(PlanRow.id)):
        for catalog_id in catalog_ids or ():
            found[catalog_id].append(plan_id)
    return found


def lives_of(session: Session, plan_ids: Iterable[str]) -> Lives:
    """Return what these plans, and the reports of them, say of their targets."""
    ids = list(plan_ids)
    if not ids:
        return Lives()
    taken = _first(session, _taken(ids))
    return Lives(
        taken=taken,
        delivered=_delivered(session, ids, taken),
        planned=_first(session, _planned(ids)),
    )


def _last_outcome(action: type[PlanActionRow]) -> sa.ScalarSelect[str]:
    """Return the query of what was reported last of an action."""
    return (
        sa.select(ExecutionRow.outcome)
        .where(ExecutionRow.plan_id == action.plan_id, ExecutionRow.action_id == action.action_id)
        .order_by(ExecutionRow.id.desc())
        .limit(1)
        .correlate(action)
        .scalar_subquery()
    )


_OUTCOME: Final = _last_outcome(PlanActionRow)
_Found = sa.Select[PlanActionRow, str, str | None]


def _base(plan_ids: list[str]) -> _Found:
    return (
        sa.select(PlanActionRow, PlanSatelliteRow.satellite_name, _OUTCOME)
        .join(
            PlanSatelliteRow,
            sa.and_(
                PlanSatelliteRow.plan_id == PlanActionRow.plan_id,
                PlanSatelliteRow.satellite_id == PlanActionRow.satellite_id,
            ),
        )
        .where(PlanActionRow.plan_id.in_(plan_ids), PlanActionRow.mode == "collect")
        .order_by(PlanActionRow.start, PlanActionRow.plan_id)
    )


def _taken(plan_ids: list[str]) -> _Found:
    # Of most actions nothing was reported: those that have a report are asked for first.
    reported = sa.exists().where(
        ExecutionRow.plan_id == PlanActionRow.plan_id,
        ExecutionRow.action_id == PlanActionRow.action_id,
    )
    return _base(plan_ids).where(reported, _OUTCOME.in_(_TAKEN))


def _planned(plan_ids: list[str]) -> _Found:
    """Return the query of what published plans have in the spans in which they are in force."""
    ends = PlanSatelliteRow.in_force_until
    return (
        _base(plan_ids)
        .join(PlanRow, PlanRow.id == PlanActionRow.plan_id)
        .where(
            PlanRow.state == "published",
            PlanActionRow.start >= PlanSatelliteRow.in_force_from,
            sa.or_(ends.is_(None), PlanActionRow.start < ends),
            sa.or_(_OUTCOME.is_(None), _OUTCOME.not_in(_NOT_DONE)),
        )
    )


def _first(session: Session, wanted: _Found) -> dict[str, TargetCollectOut]:
    found: dict[str, TargetCollectOut] = {}
    for row, satellite_name, outcome in session.execute(wanted):
        if row.target_id is not None and row.target_id not in found:
            told = {"satellite_name": satellite_name, "outcome": outcome}
            found[row.target_id] = from_row(TargetCollectOut, row, **told)
    return found


def _delivered(
    session: Session, plan_ids: list[str], taken: Mapping[str, TargetCollectOut]
) -> frozenset[str]:
    """Return the targets whose image came down in a contact that was reported as executed.

    A replan repeats what is frozen: an image may have been reported on one plan, and come down by
    another one.
    """
    contact, collect = aliased(PlanActionRow), aliased(PlanActionRow)
    spans: dict[str, list[tuple[datetime, datetime]]] = defaultdict(list)
    done = (
        sa.select(contact.satellite_id, contact.start, contact.end)
        .where(
            contact.plan_id.in_(plan_ids),
            contact.mode == "contact",
            _last_outcome(contact) == "executed",
        )
        .distinct()
        .order_by(contact.end)
    )
    for satellite_id, start, end in session.execute(done):
        spans[satellite_id].append((start, end))
    wanted = sa.select(
        collect.target_id, collect.satellite_id, collect.start, collect.delivered_at
    ).where(
        collect.plan_id.in_(plan_ids),
        collect.mode == "collect",
        collect.delivered_at.is_not(None),
    )
    return frozenset(
        target_id
        for target_id, satellite_id, start, delivered_at in session.execute(wanted)
        if target_id is not None
        and delivered_at is not None
        and (image := taken.get(target_id)) is not None
        and (image.satellite_id, image.start) == (satellite_id, start)
        and _is_within(spans.get(satellite_id, []), delivered_at)
    )


def _is_within(spans: list[tuple[datetime, datetime]], at: datetime) -> bool:
    first = bisect_left(spans, at - _ROUNDING, key=lambda span: span[1])
    return first < len(spans) and spans[first][0] <= at

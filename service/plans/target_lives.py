"""The progress of a catalogue's targets, derived from plans and reports on them.

Nothing of it is stored, so a late report or a plan's withdrawal takes effect at once.
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
    """What plans and reports say about the targets of one catalogue, by target id.

    Attributes
    ----------
    taken
        The first image taken of each target.
    delivered
        The targets with an image on the ground.
    planned
        The next image of each target in a published plan.
    """

    taken: Mapping[str, TargetCollectOut] = field(default_factory=dict)
    delivered: frozenset[str] = frozenset()
    planned: Mapping[str, TargetCollectOut] = field(default_factory=dict)

    def state_of(
        self, target_id: str, due: datetime | None, *, is_cancelled: bool, now: datetime
    ) -> TargetState:
        """Return the state of a target; an image counts even if the target was cancelled later."""
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
        """Return the image on which the state is based."""
        return self.taken.get(target_id) or self.planned.get(target_id)


def plans_by_catalog(session: Session, owner: str | None) -> dict[str, list[str]]:
    """Return the plans that were ever published, by the catalogues of their targets.

    Target ids are unique within a scenario, so that a plan and an id identify a target.
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
    """Return what these plans, and the reports on them, say about their targets."""
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
    """Return the query of the last reported outcome of an action."""
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
    # Most actions have no report, so those with one are selected first.
    reported = sa.exists().where(
        ExecutionRow.plan_id == PlanActionRow.plan_id,
        ExecutionRow.action_id == PlanActionRow.action_id,
    )
    return _base(plan_ids).where(reported, _OUTCOME.in_(_TAKEN))


def _planned(plan_ids: list[str]) -> _Found:
    """Return the query of collects in published plans, in the spans in which these are in force."""
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
    """Return the targets whose image was downlinked in a contact reported as executed.

    A replan repeats frozen actions, so an image may be reported on one plan and downlinked in
    another.
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

"""What one job's plan has that another one's has not."""

from __future__ import annotations

from collections.abc import Iterator

from fastapi import APIRouter, Depends, Response

from planner_core.referee.plan_diff import PlannedAction, plan_diff
from service.answers.rebuilt import view_of
from service.api import job_intake as intake
from service.api.conditional import etag_of, known_as, readable
from service.api.deps import CallDep, own_job_only
from service.stores import job_store as store
from service.stores.finding import no_such
from service.wire.base import read
from service.wire.plan_diffs import Difference, DiffOut, MovedOut, PlannedOut, TotalDiff
from service.wire.timelines import TimelineOut

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])


@router.get("/{job_id}/diff/{other_id}", response_model=DiffOut, responses=readable(409))
def get_diff(job_id: str, other_id: str, call: CallDep) -> DiffOut | Response:
    """Compare the plans of two jobs: actions added, removed and moved, and the totals.

    Plans of different questions are compared as well, by the ids of satellites, targets and
    stations; `questions_differ_in` says so.
    """
    with call.database.reading() as session:
        if call.caller.visible_owner not in (None, store.owner_of(session, other_id)):
            raise no_such("job", other_id)
        jobs = [intake.find_job(session, own_id) for own_id in (job_id, other_id)]
        before, after = (intake.find_timeline(session, job) for job in jobs)
    etag = etag_of(f"{job_id}/{other_id}")  # timelines never change
    if (known := known_as(call, etag)) is not None:
        return known
    return _diff(job_id, other_id, before, after)


def _diff(job_id: str, other_id: str, before: str, after: str) -> DiffOut:
    first, second = read(TimelineOut, before), read(TimelineOut, after)
    one, other = view_of(first), view_of(second)
    found = plan_diff(one, other)
    names = _Names(first, second)
    return DiffOut(
        before=job_id,
        after=other_id,
        is_empty=found.is_empty,
        questions_differ_in=tuple(_differences(first, second)),
        added=[names.shown(action) for action in found.added],
        removed=[names.shown(action) for action in found.removed],
        moved=[MovedOut(before=names.shown(a), after=names.shown(b)) for a, b in found.moved],
        totals={
            name: TotalDiff(before=one.totals[name], after=other.totals[name], delta=delta)
            for name, delta in found.totals.items()
        },
    )


def _differences(first: TimelineOut, second: TimelineOut) -> Iterator[Difference]:
    if first.scenario_sha256 != second.scenario_sha256:
        yield "scenario"
    if first.horizon != second.horizon:
        yield "horizon"
    if {s.id for s in first.satellites} != {s.id for s in second.satellites}:
        yield "satellites"
    if first.use_resources != second.use_resources:
        yield "use_resources"
    if first.dynamics != second.dynamics:
        yield "dynamics"


class _Names:
    """What the timelines call satellites, targets and stations."""

    def __init__(self, *timelines: TimelineOut):
        self._satellites = {s.id: s.name for t in timelines for s in t.satellites}
        actions = [a for t in timelines for s in t.satellites for a in s.actions]
        self._targets = {action.target_id: action.target_name for action in actions}
        self._stations = {action.station_id: action.station_name for action in actions}

    def shown(self, action: PlannedAction) -> PlannedOut:
        """Return an action as clients see it."""
        is_collect = action.mode == "collect"
        return PlannedOut(
            satellite_id=action.satellite_id,
            satellite_name=self._satellites[action.satellite_id],
            mode="collect" if is_collect else "contact",
            target_id=action.place_id if is_collect else None,
            target_name=self._targets[action.place_id] if is_collect else None,
            station_id=None if is_collect else action.place_id,
            station_name=None if is_collect else self._stations[action.place_id],
            start=action.start,
            end=action.end,
        )

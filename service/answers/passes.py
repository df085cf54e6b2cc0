"""The passes in a plan's horizon, and what the plan does in each."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from planner_core.access.station_passes import StationPass, overlapping, station_passes
from planner_core.domain import Satellite
from service.scenarios.stored_question import StoredQuestion
from service.wire.base import fields_of
from service.wire.passes import PassConflictOut, PassOut
from service.wire.timelines import ActionOut, ResourceCurvesOut, TimelineOut

_KEPT_MBIT = 3


@dataclass(frozen=True, slots=True)
class _Contact:
    action_id: str
    start: datetime
    volume_mbit: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PassFilter:
    """Which passes are wanted; None matches any."""

    station_id: str | None = None
    satellite_id: str | None = None
    start: datetime | None = None
    end: datetime | None = None
    planned: bool | None = None

    def wants(self, one: PassOut) -> bool:
        """Return whether a pass is wanted; it may lie partly outside the time span."""
        return (
            self.station_id in (None, one.station_id)
            and self.satellite_id in (None, one.satellite_id)
            and (self.start is None or one.los > self.start)
            and (self.end is None or one.aos < self.end)
            and self.planned in (None, one.planned)
        )


def passes_of_plan(
    question: StoredQuestion, timeline: TimelineOut, wanted: PassFilter
) -> list[PassOut]:
    """Return the wanted passes in order of AOS."""
    found = station_passes(question.satellites, question.ground_stations, question.horizon)
    contacts = _contacts(question.satellites, timeline)
    alone = [_pass(question, one, contacts) for one in found]
    conflicts = [PassConflictOut(**fields_of(one, PassConflictOut)) for one in alone]
    passes = (
        one.model_copy(update={"conflicts": tuple(conflicts[other] for other in others)})
        for one, others in zip(alone, overlapping(found), strict=True)
    )
    return [one for one in passes if wanted.wants(one)]


def _contacts(
    satellites: Sequence[Satellite], timeline: TimelineOut
) -> dict[tuple[str, str], list[_Contact]]:
    """Return the contacts of each satellite and station, in order."""
    by_id = {satellite.id: satellite for satellite in satellites}
    found: dict[tuple[str, str], list[_Contact]] = defaultdict(list)
    for told in timeline.satellites:
        for action in told.actions:
            if action.mode == "contact" and action.station_id is not None:
                volume_mbit = _volume_mbit(
                    by_id[told.id], action, told.resources, timeline.horizon.start
                )
                found[told.id, action.station_id].append(
                    _Contact(action.id, action.start, volume_mbit)
                )
    return found


def _volume_mbit(
    satellite: Satellite, action: ActionOut, curves: ResourceCurvesOut | None, origin: datetime
) -> float | None:
    """Return the data downlinked by a contact: the recorder's fall plus data recorded meanwhile."""
    resources = satellite.resources
    if (
        curves is None
        or resources.recorder_capacity_mbit is None
        or action.recorder_fraction_end is None
    ):
        return None
    time_s = [(instant - origin).total_seconds() for instant in curves.time]
    start_s = (action.start - origin).total_seconds()
    before = float(np.interp(start_s, time_s, curves.recorder_fraction))
    recorded = resources.telemetry_per_s * (action.end - action.start).total_seconds()
    down = max(0.0, before - action.recorder_fraction_end + recorded)
    return round(down * resources.recorder_capacity_mbit, _KEPT_MBIT)


def _pass(
    question: StoredQuestion,
    one: StationPass,
    contacts: dict[tuple[str, str], list[_Contact]],
) -> PassOut:
    """Return a pass without its conflicts."""
    satellite, station = question.satellites[one.satellite], question.ground_stations[one.station]
    aos, tca, los = map(question.horizon.instant, (one.aos_s, one.tca_s, one.los_s))
    own = contacts.get((satellite.id, station.id), [])
    starts = [contact.start for contact in own]
    held = own[bisect_left(starts, aos) : bisect_right(starts, los)]
    volumes = [contact.volume_mbit for contact in held if contact.volume_mbit is not None]
    return PassOut(
        station_id=station.id,
        station_name=station.name,
        satellite_id=satellite.id,
        satellite_name=satellite.name,
        aos=aos,
        tca=tca,
        los=los,
        max_elevation_deg=round(one.max_elevation_deg, 3),
        aos_cut=one.aos_cut,
        los_cut=one.los_cut,
        planned=bool(held),
        action_ids=tuple(contact.action_id for contact in held),
        volume_mbit=round(sum(volumes), _KEPT_MBIT) if volumes else None,
        conflicts=(),
    )

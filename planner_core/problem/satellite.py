"""One satellite's view of the table of opportunities: its rows, slews and turns to the sun."""

from __future__ import annotations

import numpy as np

from planner_core.domain import Agility, Resources
from planner_core.problem.columns import CONTACT, Floats, Ints
from planner_core.problem.downlink import Downlinks
from planner_core.problem.problem import Heading, Opportunities, SatelliteProblem, Sunlight
from planner_core.problem.sun_turns import SunPath, sun_turns
from planner_core.problem.transitions import Transitions, slews_of


def build_satellite_problem(
    index: int,
    opportunities: Opportunities,
    *,
    id: str,  # noqa: A002 - the field's own name
    name: str,
    agility: Agility,
    resources: Resources,
    sunlight: Sunlight,
    downlinks: Downlinks,
    sun: SunPath | None = None,
    events: tuple[Floats, Ints] | None = None,
    heading: Heading | None = None,
) -> SatelliteProblem:
    """Return one satellite's view of the table.

    Parameters
    ----------
    events
        ``event_s`` and ``event``, if there are more events than opportunities.
    """
    rows = np.flatnonzero(opportunities.satellite == index).astype(np.int32)
    transitions = _transitions(opportunities, rows, agility)
    start_s, end_s = transitions.start_s, transitions.end_s
    is_contact = opportunities.kind[rows] == CONTACT
    contacts = rows[is_contact]
    volume = np.zeros(len(rows))
    volume[is_contact] = downlinks.volumes(
        resources.downlink_per_s,
        opportunities.access[contacts],
        opportunities.site[contacts],
        start_s[is_contact],
        end_s[is_contact],
    )
    return SatelliteProblem(
        id=id,
        name=name,
        agility=agility,
        resources=resources,
        rows=rows,
        kind=opportunities.kind[rows],
        site=opportunities.site[rows],
        start_s=start_s,
        end_s=end_s,
        transitions=transitions,
        sunlight=sunlight,
        event_s=start_s if events is None else events[0],
        event=np.arange(len(rows), dtype=np.int32) if events is None else events[1],
        sun=sun,
        turns=sun_turns(
            resources,
            agility,
            sun,
            start_s=start_s,
            end_s=end_s,
            looks=transitions.looks,
            looked=transitions.looked,
            moves=transitions.moves,
            moved=transitions.moved,
        ),
        volume=volume,
        heading=heading,
    )


def _transitions(opportunities: Opportunities, rows: Ints, agility: Agility) -> Transitions:
    """Return a satellite's tasks and how it turns from one to the next."""
    own = rows if agility.tracks else rows[:0]
    acceleration_deg_s2 = agility.acceleration_deg_s2 if agility.tracks else None
    return Transitions(
        start_s=opportunities.start_s[rows],
        end_s=opportunities.end_s[rows],
        looks=np.ascontiguousarray(opportunities.los_start[rows]),
        looked=np.ascontiguousarray(opportunities.los_end[rows]),
        moves=opportunities.los_rate_start[own].astype(np.float64),
        moved=opportunities.los_rate_end[own].astype(np.float64),
        slews=slews_of(agility),
        acceleration_deg_s2=float(acceleration_deg_s2 or 0.0),
    )

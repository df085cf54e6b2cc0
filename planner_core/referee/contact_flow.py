"""What a contact takes down while it lasts, as the referee counts it: instant by instant."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from planner_core.problem import Problem, SatelliteProblem
from planner_core.problem.plan import Action


class Piece(NamedTuple):
    """Part of a contact, and how fast data comes down in it (recorder capacities per second)."""

    from_s: float
    to_s: float
    per_s: float


def flow(problem: Problem, satellite: SatelliteProblem, action: Action) -> list[Piece]:
    """Return the rate during a contact, in order of time; nothing of it while it is set up.

    The rate is linear between the instants at which the pass knows it, so the mean of a piece is
    that at its middle.
    """
    table, links = problem.opportunities, problem.downlinks
    station = int(table.place[action.opportunity])
    begins_s = action.start_s + float(links.stations.setup_s[station])
    if begins_s >= action.end_s:
        return []
    rate = links.passes.get(int(table.access[action.opportunity]))
    if rate is None:
        gain = float(links.stations.gain[station])
        return [Piece(begins_s, action.end_s, satellite.resources.downlink_per_s * gain)]
    inside = (rate.time_s > begins_s) & (rate.time_s < action.end_s)
    cuts_s = np.array([begins_s, *rate.time_s[inside], action.end_s])
    per_s = np.interp((cuts_s[:-1] + cuts_s[1:]) / 2.0, rate.time_s, rate.per_s)
    pieces = zip(itertools.pairwise(cuts_s.tolist()), per_s.tolist(), strict=True)
    return [Piece(from_s, to_s, mean_per_s) for (from_s, to_s), mean_per_s in pieces]

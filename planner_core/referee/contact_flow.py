"""What a contact takes down while it lasts, as the referee counts it: instant by instant."""

from __future__ import annotations

import numpy as np

from planner_core.problem import Floats, Problem, SatelliteProblem
from planner_core.problem.plan import Action


def flow(problem: Problem, satellite: SatelliteProblem, action: Action) -> Floats:
    """Return the rate during a contact, in order of time; nothing of it while it is set up.

    Returns
    -------
    From when until when (s), and how fast data comes down meanwhile, in recorder capacities per
    second. Shape ``(k, 3)``.

    Notes
    -----
    The rate is linear between the instants at which the pass knows it, so the mean of a piece is
    that at its middle.
    """
    table, links = problem.opportunities, problem.downlinks
    station = int(table.place[action.opportunity])
    begins_s = action.start_s + float(links.stations.setup_s[station])
    if begins_s >= action.end_s:
        return np.empty((0, 3))
    rate = links.passes.get(int(table.access[action.opportunity]))
    if rate is None:
        gain = float(links.stations.gain[station])
        return np.array([[begins_s, action.end_s, satellite.resources.downlink_per_s * gain]])
    first = np.searchsorted(rate.time_s, begins_s, side="right")
    inside_s = rate.time_s[first : np.searchsorted(rate.time_s, action.end_s)]
    cuts_s = np.concatenate([[begins_s], inside_s, [action.end_s]])
    per_s = np.interp((cuts_s[:-1] + cuts_s[1:]) / 2.0, rate.time_s, rate.per_s)
    return np.stack([cuts_s[:-1], cuts_s[1:], per_s], axis=1)

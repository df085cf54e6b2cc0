"""The data rate during a contact over time, as the referee computes it."""

from __future__ import annotations

import numpy as np

from planner_core.jit import inlined, kernel
from planner_core.problem import Floats, Longs, Problem, SatelliteProblem
from planner_core.problem.plan import Action, Columns


def flow(problem: Problem, satellite: SatelliteProblem, action: Action) -> Floats:
    """Return the data rate during a contact, without its set-up time, in order of time.

    Returns
    -------
    Start and end of each piece (s), and its mean data rate in recorder capacities per second.
    Shape ``(k, 3)``.

    Notes
    -----
    The rate is linear between the instants for which the pass gives it, so the mean over a piece
    is the rate at its middle.
    """
    table, links = problem.opportunities, problem.downlinks
    station = int(table.site[action.opportunity])
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


def flows(problem: Problem, satellite: SatelliteProblem, contacts: Columns) -> Floats:
    """Return the same for many contacts, one after another. Shape ``(k, 3)``."""
    table, links = problem.opportunities, problem.downlinks
    station = table.site[contacts.row]
    return _flows(
        contacts.start_s + links.stations.setup_s[station],
        contacts.end_s,
        satellite.resources.downlink_per_s * links.stations.gain[station],
        links.which(table.access[contacts.row]),
        links.rates.time_s,
        links.rates.per_s,
        links.rates.first,
    )


@kernel
def _flows(
    begins_s: Floats,
    ends_s: Floats,
    plain_per_s: Floats,
    which: Longs,
    time_s: Floats,
    per_s: Floats,
    first: Longs,
) -> Floats:
    """Return the pieces of contacts; ``which`` is the pass of each, -1 for a constant rate."""
    most = len(which)
    for i in range(len(which)):
        if which[i] >= 0:
            most += first[which[i] + 1] - first[which[i]]
    found, num = np.empty((most, 3)), 0
    for i in range(len(which)):
        if begins_s[i] >= ends_s[i]:
            continue
        if which[i] < 0:
            found[num] = begins_s[i], ends_s[i], plain_per_s[i]
            num += 1
            continue
        own_s = time_s[first[which[i]] : first[which[i] + 1]]
        own_per_s = per_s[first[which[i]] : first[which[i] + 1]]
        begin = np.searchsorted(own_s, begins_s[i], side="right")
        end = np.searchsorted(own_s, ends_s[i])
        from_s = begins_s[i]
        for k in range(begin, end + 1):
            to_s = own_s[k] if k < end else ends_s[i]
            found[num] = from_s, to_s, _between(own_s, own_per_s, k, (from_s + to_s) / 2.0)
            num += 1
            from_s = to_s
    return found[:num]


@inlined
def _between(time_s: Floats, per_s: Floats, k: int, t_s: float) -> float:
    """Return the rate at an instant between ``k - 1`` and ``k``; outside, that of the nearest."""
    if k == 0:
        return float(per_s[0])
    if k == len(time_s):
        return float(per_s[-1])
    slope = (per_s[k] - per_s[k - 1]) / (time_s[k] - time_s[k - 1])
    return float(slope * (t_s - time_s[k - 1]) + per_s[k - 1])

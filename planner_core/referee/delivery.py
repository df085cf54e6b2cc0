"""When images are on the ground: the recorder is a queue, first in, first out.

Telemetry waits in the queue as images do. An image is down when its last bit is: once as much
has been removed from the recorder as had been recorded by the end of the image, and not before
the next contact takes down data.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from planner_core.jit import kernel
from planner_core.problem import CONTACT, Floats, Longs, Problem, SatelliteProblem
from planner_core.problem.plan import Action, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.contact_flow import flow
from planner_core.referee.resource_profile import Profile

_AMOUNT_TOLERANCE: Final = 1e-9  # of a recorder's capacity, for comparing sums of many pieces


def delivered_s(
    problem: Problem, satellite: SatelliteProblem, own: Plan, profile: Profile
) -> Floats:
    """Return when each action's image is on the ground; NaN for never, and for contacts.

    Parameters
    ----------
    own
        The satellite's actions.
    profile
        Its resources while it carries them out.

    Returns
    -------
    Seconds from the start of the horizon. Shape ``(len(own.actions),)``.
    """
    found = on_ground_s(problem, satellite, own.actions, profile, profile.after.recorded)
    is_contact = problem.opportunities.kind[own.columns.row] == CONTACT
    contacts = list(itertools.compress(own.actions, is_contact.tolist()))
    found[is_contact] = np.nan
    end_s = own.columns.end_s
    # An image without data would be down before it is taken; it too waits for the next contact.
    for image in np.flatnonzero(found < end_s - TIME_TOLERANCE_S).tolist():
        found[image] = _next_flow_s(problem, satellite, contacts, end_s[image])
    return found


def _next_flow_s(
    problem: Problem, satellite: SatelliteProblem, contacts: Sequence[Action], after_s: float
) -> float:
    """Return when the first contact that starts at ``after_s`` or later takes data down, or NaN."""
    later = [action for action in contacts if action.start_s >= after_s - TIME_TOLERANCE_S]
    flows = [flow(problem, satellite, action) for action in later]
    return min((float(pieces[0, 0]) for pieces in flows if len(pieces)), default=math.nan)


def on_ground_s(
    problem: Problem,
    satellite: SatelliteProblem,
    actions: Sequence[Action],
    profile: Profile,
    queued: Floats,
) -> Floats:
    """Return when these amounts of a recorder's queue are on the ground; see ``down_s``."""
    time_s, removed = _removal(problem, satellite, actions, profile)
    return down_s(queued, time_s, removed)


def down_s(queued: Floats, time_s: Floats, removed: Floats) -> Floats:
    """Return when the given amounts of the queue are down.

    Parameters
    ----------
    queued
        For each item, all that had been recorded up to and including it. This also counts what
        the recorder holds at the start, oldest first. Any order; shape ``(k,)``.
    time_s, removed
        How much has been taken down by each instant, in time order; linear in between. ``(n,)``.

    Returns
    -------
    Instants, NaN for never. Shape ``(k,)``.

    >>> down_s(np.array([2.0, 5.0]), np.array([0.0, 10.0, 14.0]), np.array([0.0, 0.0, 4.0]))
    array([12., nan])
    """
    reached = np.searchsorted(removed, queued - _AMOUNT_TOLERANCE)
    return _between(queued, time_s, removed, reached)


@kernel
def _between(queued: Floats, time_s: Floats, removed: Floats, reached: Longs) -> Floats:
    """Return when the amounts are down; ``reached`` is the first index with that much removed."""
    found = np.full(len(queued), np.nan)
    for i in range(len(queued)):
        if reached[i] == len(removed):
            continue
        after = min(max(reached[i], 1), len(removed) - 1)
        before = max(after - 1, 0)
        step = removed[after] - removed[before]
        share = 0.0
        if step > 0.0:
            share = min(max((queued[i] - removed[before]) / step, 0.0), 1.0)
        found[i] = time_s[before] + share * (time_s[after] - time_s[before])
    return found


def _removal(
    problem: Problem, satellite: SatelliteProblem, actions: Sequence[Action], profile: Profile
) -> tuple[Floats, Floats]:
    """Return instants and how much has been removed by each, linear in between."""
    if problem.dynamics == "physical":
        return profile.curve.time_s, profile.curve.removed
    # The paper's events book a contact at its start; here its bits come down one after another.
    points = [(0.0, 0.0)]
    for action, before, after in zip(
        actions, profile.before.removed.tolist(), profile.after.removed.tolist(), strict=True
    ):
        if after > before:
            pieces = flow(problem, satellite, action)
            points += _one_after_another(pieces, before, after)
    table = np.array(points)
    return table[:, 0].copy(), table[:, 1].copy()


def _one_after_another(pieces: Floats, before: float, after: float) -> list[tuple[float, float]]:
    """Return points (instant, removed so far) of a contact, from its first bit to its last."""
    points = [(float(pieces[0, 0]), before)]
    removed = before
    for from_s, to_s, per_s in pieces.tolist():
        whole = (to_s - from_s) * per_s
        if removed + whole >= after:
            points.append((from_s + (after - removed) / per_s, after))
            return points
        removed += whole
        points.append((to_s, removed))
    return [*points[:-1], (points[-1][0], after)]

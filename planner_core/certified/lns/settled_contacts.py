"""What images earn with given contacts, and which contacts stations can serve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.problem import COLLECT, Floats, Ints, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import taking
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.worth import share_earned


def with_contacts(
    problem: Problem, contacts: list[int], plan: Plan | None, verdict: Timeline | None
) -> Problem:
    """Return the problem with these contacts kept, and what images earn with them.

    Parameters
    ----------
    plan, verdict
        Plan whose images are queued, None for none; the referee's timeline of it, if at hand.
    """
    return replace(
        taking(problem, contacts),
        worth=worth_with(problem, contacts, plan, verdict),
        leaves_none_on_board=problem.objective.collected_share == 0.0,
    )


def worth_with(
    problem: Problem,
    contacts: list[int],
    plan: Plan | None = None,
    verdict: Timeline | None = None,
) -> Floats:
    """Return what each image earns if these contacts are taken, and nothing else changes.

    An image comes down in the first contact after it that has time left, after the images that the
    plan takes before it. An image of the plan comes down when it does there, by ``verdict`` or else
    by a replay. Shape ``(n,)``.
    """
    table = problem.opportunities
    down_s = np.full(len(table), np.inf)
    taken, every = np.zeros(0, dtype=np.int64), np.array(contacts, dtype=np.int32)
    if plan is not None:
        verdict = verdict or replay(problem, plan, in_detail=False)
        images = verdict.collected.values()
        taken = np.array([plan.actions[i.position].opportunity for i in images], dtype=np.int64)
        down_s[taken] = [np.inf if i.delivered_s is None else i.delivered_s for i in images]
    for index, satellite in enumerate(problem.satellites):
        own = satellite.rows[satellite.kind == COLLECT]
        queue = taken[table.satellite[taken] == index]
        passes = every[table.satellite[every] == index]
        free = own[np.isin(own, queue, invert=True)]
        down_s[free] = _down_s(problem, passes, queue, down_s[queue], free)
    age_s = down_s - table.end_s
    worth: Floats = problem.worth_on_ground * share_earned(problem.objective, age_s)
    return np.where(table.kind == COLLECT, np.minimum(worth, problem.worth), 0.0)


def _down_s(
    problem: Problem, contacts: Ints, queue: Ints, queue_down_s: Floats, images: Ints
) -> Floats:
    """Return when images of a satellite are down, each after those queued before it."""
    table = problem.opportunities
    satellite = problem.satellites[int(table.satellite[images[0]])] if len(images) else None
    found = np.full(len(images), np.inf)
    if satellite is None or len(contacts) == 0:
        return found
    order = np.argsort(table.end_s[queue], kind="stable")
    last_s = np.append(0.0, np.maximum.accumulate(queue_down_s[order]))
    before_s = last_s[np.searchsorted(table.end_s[queue][order], table.end_s[images])]
    ready_s = table.start_s[contacts] + problem.downlinks.stations.setup_s[table.site[contacts]]
    useful_s = np.maximum(table.end_s[contacts] - ready_s, 1e-9)
    rate = satellite.volume[problem.local_row[contacts]] / useful_s
    size = (table.end_s - table.start_s)[images] * satellite.resources.collect_fill_per_s
    at = np.searchsorted(table.start_s[contacts], table.end_s[images])
    while np.any(is_open := (at < len(contacts)) & np.isinf(found)):
        c = np.minimum(at, len(contacts) - 1)
        down_s = np.maximum(ready_s[c], before_s) + size / np.maximum(rate[c], 1e-12)
        fits = is_open & (down_s <= table.end_s[contacts[c]])
        found[fits] = down_s[fits]
        at += is_open & ~fits
    return found


def served(problem: Problem, contacts: tuple[int, ...]) -> list[int]:
    """Return the contacts for which stations have an antenna, earlier ones first."""
    found = list[int]()
    for row in sorted(contacts, key=lambda row: float(problem.opportunities.start_s[row])):
        if _is_served(problem, found, row):
            found.append(row)
    return found


def _is_served(problem: Problem, chosen: list[int], row: int) -> bool:
    """Return whether the station has an antenna left for a contact besides those chosen."""
    table = problem.opportunities
    beside = [
        other
        for other in chosen
        if table.site[other] == table.site[row]
        and table.start_s[other] < table.end_s[row]
        and table.end_s[other] > table.start_s[row]
    ]
    return len(beside) < int(problem.station_antennas[table.site[row]])

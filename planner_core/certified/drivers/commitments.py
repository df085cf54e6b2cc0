"""What plans should commit to where it counts when images come down.

Two things decide that: how much data may stay on board at the end, and, where images are worth less
the later they come down, which contacts are taken. Each choice makes a problem in which every image
has one worth, whatever else is done: how much may stay is a limit on the recorder at the end; with
contacts that must be taken an image comes down with the first one after it. The best plans of some
such problems tell which one to go on with. The referee weighs them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.problem import COLLECT, CONTACT, Bools, Floats, Kept, Problem, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.worth import share_earned

_IMAGES: Final = (40, 20, 10, 5, 2, 0)  # typical ones, of each satellite
_IMAGES_OF_FLEETS: Final = (20, 5, 0)
_PATIENCE: Final = 2  # commitments that lead to nothing better
_HALF_LIVES: Final = (0.25, 0.5, 1.0, 2.0)  # between contacts
_LEAST_SHARE: Final = 0.4  # of the longest contact: shorter ones bring little down


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Committed:
    """A problem for the searches for plans, and a plan of it to begin with."""

    problem: Problem
    plan: Plan


def best_commitment(best: Incumbent, unit: float, first_goal: float, seed: int) -> Committed | None:
    """Return the problem to go on with; None where the problem as it is leads to better plans.

    Better plans on the way are offered to ``best``.

    Parameters
    ----------
    unit, first_goal
        As ``ChoiceSearch`` takes them.
    """
    problem = best.problem
    if not problem.counts_delivery or problem.objective.is_delivered:
        return None
    found, most, idle = None, -np.inf, 0
    for part in _commitments(problem):
        if best.budget.is_spent() or idle == _PATIENCE:
            break
        choices = ChoiceSearch(part, unit, seed, best.budget.stop)
        choices.start(np.zeros(len(problem.opportunities), dtype=np.bool_), first_goal)
        best.offer(choices.plan)
        reward = replay(problem, choices.plan).reward
        idle += 1
        if reward > most:
            found = None if part is problem else Committed(problem=part, plan=choices.plan)
            most, idle = reward, 0
        best.report("plans")
    return found


def _commitments(problem: Problem) -> Iterator[Problem]:
    """Yield the problem under one commitment after another."""
    yield problem
    half_life_s = problem.objective.half_life_s
    if half_life_s is None:
        fill = _typical_fill(problem)
        is_fleet = sum(len(satellite) > 0 for satellite in problem.satellites) > 1
        for num_images in _IMAGES_OF_FLEETS if is_fleet else _IMAGES:
            yield replace(problem, left_on_board=num_images * fill)
        return
    yield replace(problem, left_on_board=0.0)
    for share in _HALF_LIVES:
        yield with_contacts(problem, share * half_life_s)


def with_contacts(problem: Problem, spacing_s: float) -> Problem:
    """Return the problem with contacts that must be taken, each satellite's so far apart.

    An image is worth there what it earns that comes down right at the start of the next of them.
    """
    chosen = _spaced_contacts(problem, spacing_s)
    already = {kept.row for kept in problem.pinned.kept}
    new = tuple(Kept(row=row, pointer="") for row in chosen if row not in already)
    return replace(
        problem,
        worth=worth_with(problem, chosen),
        pinned=replace(problem.pinned, kept=(*problem.pinned.kept, *new)),
        left_on_board=0.0,
    )


def _spaced_contacts(problem: Problem, spacing_s: float) -> list[int]:
    """Return the contact that takes down most in each span, where stations serve them all."""
    table, chosen = problem.opportunities, list[int]()
    for satellite in problem.satellites:
        contacts = np.flatnonzero(satellite.kind == CONTACT)
        volume = satellite.volume[contacts]
        contacts = contacts[volume >= _LEAST_SHARE * volume.max(initial=0.0)]
        free_s = 0.0
        while True:
            start_s = satellite.start_s[contacts]
            first_s = start_s[start_s >= free_s].min(initial=np.inf)
            within = contacts[(start_s >= free_s) & (start_s < first_s + spacing_s)]
            rows = [int(r) for r in satellite.rows[within] if _is_served(problem, chosen, int(r))]
            if not np.isfinite(first_s):
                break
            free_s = first_s + spacing_s
            if rows:
                own = max(rows, key=lambda row: float(satellite.volume[problem.local_row[row]]))
                chosen.append(own)
                free_s = max(free_s, float(table.end_s[own]))
    return chosen


def _is_served(problem: Problem, chosen: list[int], row: int) -> bool:
    """Return whether the station has an antenna left for a contact beside those chosen."""
    table = problem.opportunities
    beside = [
        other
        for other in chosen
        if table.place[other] == table.place[row]
        and table.start_s[other] < table.end_s[row]
        and table.end_s[other] > table.start_s[row]
    ]
    return len(beside) < int(problem.station_antennas[table.place[row]])


def worth_with(problem: Problem, contacts: list[int]) -> Floats:
    """Return what each image earns that comes down at the start of the next of these contacts."""
    table = problem.opportunities
    age_s = np.full(len(table), np.inf)
    for index, satellite in enumerate(problem.satellites):
        starts = sorted(float(table.start_s[r]) for r in contacts if table.satellite[r] == index)
        starts_s = np.array([*starts, np.inf])
        own = satellite.rows[satellite.kind == COLLECT]
        age_s[own] = starts_s[np.searchsorted(starts_s[:-1], table.end_s[own])] - table.end_s[own]
    worth: Floats = problem.worth_on_ground * share_earned(problem.objective, age_s)
    return np.minimum(worth, problem.worth)


def _typical_fill(problem: Problem) -> float:
    """Return what an image takes of a recorder, about."""
    fill = np.concatenate(
        [
            (satellite.end_s - satellite.start_s)[_earning(problem, satellite)]
            * satellite.resources.collect_fill_per_s
            for satellite in problem.satellites
        ]
    )
    return float(np.median(fill)) if len(fill) else 0.0


def _earning(problem: Problem, satellite: SatelliteProblem) -> Bools:
    earning: Bools = (satellite.kind == COLLECT) & (problem.worth[satellite.rows] > 0.0)
    return earning

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

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, Bools, Problem, SatelliteProblem
from planner_core.problem.plan import Plan


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
        if best.budget.is_spent() or idle == TUNING.tries:
            break
        choices = ChoiceSearch(part, unit, seed, best.budget.stop)
        choices.start(np.zeros(len(problem.opportunities), dtype=np.bool_), first_goal)
        best.offer(choices.plan)
        reward = best.judge(choices.plan).reward
        idle += 1
        if reward > most:
            found = None if part is problem else Committed(problem=part, plan=choices.plan)
            most, idle = reward, 0
        best.report("plans")
    return found


def _commitments(problem: Problem) -> Iterator[Problem]:
    """Yield the problem under one commitment after another."""
    yield problem
    fill = _typical_fill(problem)
    is_fleet = sum(len(satellite) > 0 for satellite in problem.satellites) > 1
    for num_images in TUNING.images_on_board[1::2] if is_fleet else TUNING.images_on_board:
        yield replace(problem, left_on_board=num_images * fill)


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

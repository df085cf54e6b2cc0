"""What plans should commit to where it counts when images come down.

Two things decide that: how much data may stay on board at the end, and, where images are worth less
the later they come down, which contacts are taken. Each choice makes a problem in which every image
has one worth, whatever else is done: how much may stay is a limit on the recorder at the end; with
contacts that must be taken an image comes down with the first one after it. The best plans of some
such problems tell which one to go on with. The referee weighs them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.strategies.supports import is_shared
from planner_core.certified.tolerances import ROUNDING
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, Bools, Problem, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.referee.timeline import Timeline


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Committed:
    """A problem for the searches for plans, and a plan of it to begin with."""

    problem: Problem
    plan: Plan


def best_commitment(best: Incumbent, unit: float, first_goal: float, seed: int) -> Committed | None:
    """Return the problem to go on with; None where the problem as it is leads to better plans.

    Of two that lead as far it is the one that leaves less on board. A few moves tell more than
    first plans do: 500 targets and a share of 0.5 (`paper`, two draws) come to 281 and 282.5 after
    12 CPU seconds, and to 273 and 282 by the first plans. Fleets lose a little by them. Better
    plans on the way are offered to ``best``.

    Searches that go on from a plan count each image as if it came down. Where more may stay than
    the plan leaves they leave more and more, so the limit is the least amount that it keeps to: 18
    missions of four satellites, 500 to 800 targets, shares of 0.5 and 0.9, are 1.36 % below their
    bounds on average after ten CPU seconds, and 1.65 % with the amount it was tried with.

    Parameters
    ----------
    unit, first_goal
        As ``ChoiceSearch`` takes them.
    """
    problem = best.problem
    if not problem.counts_delivery or problem.objective.is_delivered:
        return None
    fill = _typical_fill(problem)
    amounts = _amounts(problem, fill)
    num_moves = 0 if is_shared(problem) else TUNING.several
    found, most, idle, least_left = None, -np.inf, 0, np.inf
    for amount in (np.inf, *amounts):
        if best.budget.is_spent() or idle == TUNING.tries:
            break
        if least_left - ROUNDING <= amount < np.inf:
            continue  # a plan that is known leaves no more than that
        choices = ChoiceSearch(_with_most(problem, amount), unit, seed, best.budget.stop)
        choices.start(np.zeros(len(problem.opportunities), dtype=np.bool_), first_goal)
        best.offer(choices.plan)
        for _ in range(num_moves):
            choices.move()
        best.offer(choices.plan)
        timeline = best.judge(choices.plan)
        left = _most_left(problem, choices.plan, timeline) if timeline.is_valid else np.inf
        least_left = min(least_left, left)
        idle = 0 if timeline.reward > most else idle + 1
        if timeline.reward >= most:
            kept = [one for one in amounts if one >= left - ROUNDING]
            part = _with_most(problem, min([amount, *kept]))
            found = None if part is problem else Committed(problem=part, plan=choices.plan)
            most = timeline.reward
        best.report("plans")
    return found


def _amounts(problem: Problem, fill: float) -> list[float]:
    """Return how much may stay in each recorder, in the order of trials.

    Parameters
    ----------
    fill
        What an image takes of a recorder, about.
    """
    numbers = TUNING.images_on_board[1::2] if is_shared(problem) else TUNING.images_on_board
    return [number * fill for number in numbers]


def _with_most(problem: Problem, amount: float) -> Problem:
    return problem if amount == np.inf else replace(problem, left_on_board=amount)


def _most_left(problem: Problem, plan: Plan, timeline: Timeline) -> float:
    """Return what images fill of the recorder in which most of them stay."""
    left = np.zeros(len(problem.satellites))
    for image in timeline.collected.values():
        if not image.is_downlinked:
            action = plan.actions[image.position]
            resources = problem.satellites[image.satellite].resources
            left[image.satellite] += (action.end_s - action.start_s) * resources.collect_fill_per_s
    return float(left.max())


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

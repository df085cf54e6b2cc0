r"""Plans of simple planners for batteries that charge only between slews to the sun and back.

A planner that takes each image as it comes slews to the sun after every one of them. A price of
energy avoids that: an image costs what it draws and the charge that its two slews forgo, but next
to other images hardly more than what it draws. Taking ``j`` after ``i`` thus costs
:math:`\mu\,(d_j + f_j - t_j - g_{ij})` with the draw :math:`d`, the charge :math:`f` up to the
arrival at the sun and :math:`t` up to the departure from it, less :math:`g` if there is no time for
the sun between the two. The price depends on the battery level :math:`b`,
:math:`\mu = \mu_0\, e^{\kappa (0.6 - b)}`: energy is cheap while the battery is nearly full.

A few dozen pairs of :math:`\mu_0` and :math:`\kappa` are tried on each mission, in milliseconds
each, and the best plan is kept.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.dp.resource_network import Network, strict_network_of
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.jit import inlined, kernel
from planner_core.mdp.actions import next_action
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import Bytes, Floats, Ints, Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.sequential import Subproblem

_PRICES: Final = (0.0, 0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2)
"""Of the energy that an image draws, as shares of an image's worth."""
_FOLLOWING: Final = (1.0, 2.0, 4.0, 6.0)
_CONTACTS_ABOVE: Final = (0.45, 0.7)
"""Recorder levels from which on a contact is worth its power."""
_AHEAD: Final = 40
"""Feasible tasks that a look ahead compares."""
_MOVES: Final = 10  # of the choice search, for each satellite
_MOST_UNITS: Final = 2000
_NEUTRAL: Final = 0.6  # the battery level at which the price of energy is mu_0


class Priced(NamedTuple):
    """A satellite's plan and the figures it was made with.

    Attributes
    ----------
    rows
        Of the track, in order.
    worth
        What its new targets earn.
    price, following
        Price of an image's draw, in images, and how strongly it depends on the battery (kappa).
    """

    rows: list[int]
    worth: float
    price: float
    following: float


def is_priced(problem: Problem, subproblem: Subproblem) -> bool:
    """Return whether the subproblem's satellite must slew to the sun to charge."""
    return problem.use_resources and subproblem.satellite.resources.sun_pointing == "slew"


def best_priced(problem: Problem, subproblem: Subproblem, *, looks_ahead: bool) -> Priced:
    """Return the best plan over all prices, by the rule or by looking ahead at what follows."""
    track = subproblem.track
    worth = np.where(track.is_contact == 1, 0.0, problem.worth[subproblem.satellite.rows])
    is_new = (track.is_contact == 0) & (subproblem.collected[track.site] == 0)
    draw, image = _typical(track, worth, is_new)
    network = strict_network_of(problem, subproblem.satellite) if looks_ahead else None
    breadth = _AHEAD if looks_ahead else 1
    best = Priced([], -1.0, 0.0, 0.0)
    for price in _PRICES:
        per_energy = price * image / draw
        ahead = np.zeros(len(worth))
        if network is not None:
            ahead = values_ahead(network, np.where(is_new, worth, 0.0), per_energy)
        for following in _FOLLOWING if price > 0.0 else (0.0,):
            for contact_above in _CONTACTS_ABOVE:
                collected = subproblem.collected.copy()
                rows = priced_plan(
                    track, worth, collected, ahead, per_energy, following, contact_above, breadth
                )
                gained = float(worth[rows].sum())
                if gained > best.worth:
                    best = Priced(rows.tolist(), gained, price, following)
    return best


def better_of(
    problem: Problem, subproblem: Subproblem, rows: list[int], *, looks_ahead: bool
) -> list[int]:
    """Return a search's plan, or a priced one that earns more."""
    if not is_priced(problem, subproblem):
        return rows
    track = subproblem.track
    own = np.array(rows, dtype=np.int64)
    images = own[(track.is_contact[own] == 0) & (subproblem.collected[track.site[own]] == 0)]
    gained = problem.worth_of(subproblem.satellite.rows[images])
    priced = best_priced(problem, subproblem, looks_ahead=looks_ahead)
    if priced.worth <= gained:
        return rows
    subproblem.report(1.0, priced.worth)
    return priced.rows


def _typical(track: Track, worth: Floats, is_new: Bytes) -> tuple[float, float]:
    """Return roughly what an image draws and earns; both are always positive."""
    offered = np.flatnonzero(is_new & (worth > 0.0))
    if len(offered) == 0:
        return 1.0, 1.0
    draw = float(np.median(track.resources.battery_cost[offered]))
    return max(draw, 1e-9), float(worth[offered].mean())


@kernel
def values_ahead(network: Network, worth: Floats, per_energy: float) -> Floats:
    """Return what can be gained after each task, less the energy; targets may count repeatedly.

    Backward in one pass over the arcs. Shape ``(m,)``.

    Parameters
    ----------
    worth
        Of an image by each task; 0 for contacts. Shape ``(m,)``.
    per_energy
        Price of a full battery.
    """
    m = len(worth)
    after, idle = np.empty(m), np.zeros(m + 1)
    for k in range(m - 1, -1, -1):
        best = idle[network.idle_from[k]]
        for at in range(network.near_first[k], network.near_first[k + 1]):
            j = network.near_rows[at]
            paid = per_energy * (network.energy_cost[j] - network.near_give[at])
            best = max(best, worth[j] - paid + after[j])
        after[k] = best
        own = worth[k] - per_energy * network.energy_cost[k] + best
        idle[k] = max(idle[k + 1], own)
    return after


@kernel
def priced_plan(
    track: Track,
    worth: Floats,
    collected: Bytes,
    ahead: Floats,
    per_energy: float,
    following: float,
    contact_above: float,
    breadth: int,
) -> Ints:
    """Return the rows of the plan at these prices; marks its targets in ``collected``.

    Parameters
    ----------
    ahead
        What can be gained after each task. Shape ``(m,)``.
    breadth
        How many of the next feasible tasks are compared. With 1 this is the rule, which takes
        the next one that pays for itself.
    """
    m = len(worth)
    rows = np.empty(m, dtype=np.int32)
    count = 0
    cursor, last = NO_TASK, NO_TASK
    battery, recorder = track.resources.battery_start, track.resources.recorder_start
    while True:
        price = per_energy * math.exp(following * (_NEUTRAL - battery))
        row, is_chosen, best = cursor, -1, -np.inf
        seen = 0
        while seen < breadth:
            row = next_action(
                track, last, row + 1, battery, recorder, True, collected, True, contact_above
            )
            if row == m:
                break
            must = track.is_contact[row] == 1 or row == track.next_kept[last + 1]
            value = worth[row] - price * energy_of(track, last, row) + ahead[row]
            if breadth == 1 and not must and value < 0.0:
                continue
            seen += 1
            if value > best:
                best, is_chosen = value, row
            # A(s) ends with a task that must be taken; a contact is offered only when needed.
            if must:
                break
        if is_chosen < 0:
            return rows[:count]
        battery, recorder, _ = take(track.resources, last, is_chosen, battery, recorder)
        if not track.is_contact[is_chosen]:
            collected[track.site[is_chosen]] = 1
        rows[count] = is_chosen
        count += 1
        cursor = last = is_chosen


@inlined
def energy_of(track: Track, last: int, row: int) -> float:
    """Return the energy that taking a task costs: its draw, and the charge forgone for it."""
    resources = track.resources
    charge_from_s = resources.charge_from_s[last] if last >= 0 else 0.0
    # From the departure on, charge is forgone until the sun is reached again.
    until_s = max(resources.charge_to_s[row], charge_from_s)
    return float(
        resources.battery_cost[row]
        + resources.charge_per_s * (resources.charge_from_s[row] - until_s)
    )


def with_choices(problem: Problem, solution: Solution, budget: Budget, seed: int) -> Solution:
    """Return a solution improved by a few moves that settle each target on one of its times.

    A better batch of images often requires several visits to the sun to be moved at once, which no
    step-by-step search does. If no satellite slews to the sun, the solution is unchanged.
    """
    turning = [s for s in problem.satellites if s.resources.sun_pointing == "slew" and len(s)]
    if not (problem.use_resources and turning) or budget.is_spent():
        return solution
    top = float(problem.best_worth.sum())
    unit = problem.reward_unit
    if unit == 0.0 or top / unit > _MOST_UNITS:
        unit = max(top / _MOST_UNITS, 1e-12)
    moves = ChoiceSearch(problem, unit, seed, budget.stop)
    moves.adopt(solution.plan)
    for _ in range(_MOVES * len(turning)):
        if budget.is_spent():
            break
        moves.move()
    before, after = (
        replay(problem, solution.plan, in_detail=False),
        replay(problem, moves.plan, in_detail=False),
    )
    if not after.is_valid or after.reward <= before.reward:
        return solution
    return replace(solution, plan=moves.plan)

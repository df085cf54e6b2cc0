"""Large-neighbourhood search on a plan without resources: windows replanned by longest chains.

Each move picks a stretch of one satellite's tasks at random and keeps the rest of the plan.
First it lets go of a few targets that are collected elsewhere but could be collected here:
without that the search soon stalls. Then the heaviest chain between the tasks on either side
takes the place of what was there, if the plan is worth no less.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.comparable import Order, comes_before, order_of
from planner_core.draws import Uint64s, draws_of, next_draw
from planner_core.jit import kernel
from planner_core.plan import Plan
from planner_core.problem import COLLECT, CONTACT, Bools, Bytes, Floats, Ints, Problem
from planner_core.solvers.base import Budget, Solution

_FREE: Final = -1
_ELSEWHERE: Final = -2
_MOVES_AT_A_TIME: Final = 500
_MAX_WINDOW: Final = 100
_MAX_RELEASED: Final = 2  # more let go of what the window cannot make up for
_TIE: Final = 1e-5  # of a task's worth; all of a window's together must stay below one task


def improved(
    problem: Problem, plan: Plan, moves_per_task: float, budget: Budget, seed: int
) -> Plan:
    """Return a plan that earns no less, after moves in proportion to the opportunities.

    Only collects and agility count; contacts of ``plan`` are dropped. Satellites take turns.
    """
    table = problem.opportunities
    draws = draws_of(seed)
    is_taken = np.zeros(len(table), dtype=np.bool_)
    is_taken[[a.opportunity for a in plan.actions]] = True
    is_taken[table.kind == CONTACT] = False
    left = int(moves_per_task * len(table))
    while left > 0 and not budget.is_spent():
        for satellite in problem.satellites:
            own = is_taken[satellite.rows]
            if len(own) == 0:
                continue
            others = np.flatnonzero(is_taken)
            holder = np.full(len(problem.target_ids), _FREE, dtype=np.int32)
            holder[table.place[others]] = _ELSEWHERE
            holder[satellite.place[own]] = np.flatnonzero(own)
            worth = np.where(
                satellite.kind == COLLECT,
                problem.target_reward[np.minimum(satellite.place, len(holder) - 1)],
                0.0,
            )
            # What must be taken is worth more than all else, so that no move drops it.
            kept = problem.kept_local(satellite)
            kept = kept[satellite.kind[kept] == COLLECT]
            worth[kept] += 1.0 + float(problem.target_reward.sum())
            _improve(
                order_of(satellite.transitions), worth, satellite.place, own, holder, draws,
                _MOVES_AT_A_TIME, budget.stop,
            )  # fmt: skip
            is_taken[satellite.rows] = own
            left -= _MOVES_AT_A_TIME
    return Plan.of(problem, _rows(is_taken))


def polished(
    problem: Problem, solution: Solution, moves_per_task: float, budget: Budget
) -> Solution:
    """Return a search's answer with its plan improved, where agility alone counts."""
    if problem.use_resources or moves_per_task == 0.0 or budget.is_spent():
        return solution
    plan = improved(problem, solution.plan, moves_per_task, budget, 0)
    return replace(solution, plan=plan)


def _rows(is_taken: Bools) -> Iterable[int]:
    return [int(row) for row in np.flatnonzero(is_taken)]


@kernel
def _improve(
    order: Order,
    worth: Floats,
    place: Ints,
    is_taken: Bools,
    holder: Ints,
    draws: Uint64s,
    num_moves: int,
    stop: Bytes,
) -> None:
    """Make moves on one satellite's chain, in place.

    Parameters
    ----------
    holder
        For each target the row that collects it, or ``_FREE``, or ``_ELSEWHERE`` where
        another satellite does. Shape ``(num_targets,)``.
    """
    m = len(worth)
    released = np.empty(_MAX_RELEASED, dtype=np.int32)
    taken_before = np.empty(_MAX_WINDOW, dtype=np.int32)
    for _ in range(num_moves):
        if stop[0]:
            return
        size = min(m, 2 + int(next_draw(draws) * (_MAX_WINDOW - 2)))
        low = int(next_draw(draws) * (m - size + 1))
        high = low + size
        old_worth, num_released = 0.0, 0
        num_before = 0
        for row in range(low, high):
            if is_taken[row]:
                taken_before[num_before] = row
                num_before += 1
                old_worth += worth[row]
                is_taken[row] = False
                holder[place[row]] = _FREE
        for _ in range(1 + int(next_draw(draws) * _MAX_RELEASED)):
            row = low + int(next_draw(draws) * size)
            held = holder[place[row]] if worth[row] > 0.0 else _FREE
            if held >= 0 and _may_leave(order, is_taken, held, low, high):
                released[num_released] = held
                num_released += 1
                old_worth += worth[held]
                is_taken[held] = False
                holder[place[held]] = _FREE
        gained = _fill(order, worth, place, is_taken, holder, draws, low, high)
        if gained >= old_worth - 1e-9:
            continue
        for row in range(low, high):
            if is_taken[row]:
                is_taken[row] = False
                holder[place[row]] = _FREE
        for i in range(num_before):
            is_taken[taken_before[i]] = True
            holder[place[taken_before[i]]] = taken_before[i]
        for i in range(num_released):
            is_taken[released[i]] = True
            holder[place[released[i]]] = released[i]


@kernel
def _neighbours(is_taken: Bools, row: int, high: int) -> tuple[int, int]:
    """Return the taken rows before ``row`` and from ``high`` on; -1 and m where there is none."""
    before, after = row - 1, high
    while before >= 0 and not is_taken[before]:
        before -= 1
    while after < len(is_taken) and not is_taken[after]:
        after += 1
    return before, after


@kernel
def _may_leave(order: Order, is_taken: Bools, row: int, low: int, high: int) -> bool:
    """Return whether the tasks around ``row``, outside the empty window, can do without it."""
    before, after = _neighbours(is_taken, row, row + 1)
    if before < 0 or after == len(is_taken):
        return True
    # What fills the window in between will fit both.
    is_beside_window = before < low and after >= high
    return is_beside_window or comes_before(order, before, after)


@kernel
def _fill(
    order: Order,
    worth: Floats,
    place: Ints,
    is_taken: Bools,
    holder: Ints,
    draws: Uint64s,
    low: int,
    high: int,
) -> float:
    """Take the heaviest chain of the empty window that fits its surroundings; return its worth.

    Ties are broken at random, so that the search wanders over plans of equal worth. Answers
    -1 where nothing fits and the tasks on either side cannot do without.
    """
    before, after = _neighbours(is_taken, low, high)
    size = high - low
    offered = _offered(worth, place, holder, draws, low, high)
    value = np.full(size, -1.0)  # of the best chain to each task, ties broken; -1 for none
    chain_worth = np.zeros(size)
    previous = np.full(size, -1, dtype=np.int32)
    best, best_at = 0.0, -1
    if before >= 0 and after < len(is_taken) and not comes_before(order, before, after):
        best = -1.0
    for i in range(size):
        row = low + i
        if not offered[i]:
            continue
        reached = 0.0 if before < 0 or comes_before(order, before, row) else -1.0
        for j in range(i):
            if value[j] > reached and comes_before(order, low + j, row):
                reached = value[j]
                previous[i] = j
        if reached < 0.0:
            continue
        value[i] = reached + worth[row] * (1.0 + _TIE * next_draw(draws))
        chain_worth[i] = worth[row] + (chain_worth[previous[i]] if previous[i] >= 0 else 0.0)
        if value[i] > best and (after == len(is_taken) or comes_before(order, row, after)):
            best, best_at = value[i], i
    if best_at < 0:
        return best
    at = best_at
    while at >= 0:
        is_taken[low + at] = True
        holder[place[low + at]] = low + at
        at = previous[at]
    return float(chain_worth[best_at])


@kernel
def _offered(
    worth: Floats, place: Ints, holder: Ints, draws: Uint64s, low: int, high: int
) -> Bools:
    """Return which tasks of the window may be taken: of each free target one, at random."""
    offered = np.zeros(high - low, dtype=np.bool_)
    for row in range(low, high):
        if worth[row] <= 0.0 or holder[place[row]] != _FREE:
            continue
        offered[row - low] = True
        for other in range(low, row):
            if offered[other - low] and place[other] == place[row]:
                loser = other if next_draw(draws) < 0.5 else row
                offered[loser - low] = False
                break
    return offered

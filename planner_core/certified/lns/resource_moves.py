"""Moves of the window search under battery and recorder, contacts included.

A stretch of one satellite's tasks is replanned. The new path may also take a target that is imaged
outside the stretch, at next to no gain: the other image is then dropped, which frees energy
elsewhere at no cost.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.certified.dp.resource_network import give_between
from planner_core.certified.lns.moves import Assignment
from planner_core.certified.lns.resource_labels import (
    After,
    SearchData,
    Workspace,
    best_label,
    cost_at_end,
)
from planner_core.certified.signs import NEVER, NOWHERE, UNASSIGNED
from planner_core.certified.sizes import LABELS_PER_TASK, RESOURCE_WINDOW_NODES
from planner_core.certified.tolerances import ROUNDING, SLIGHT, STAYS
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.problem import Bytes

_FEWEST_TASKS, _MOST_TASKS = TUNING.window_tasks
_FOR_UNASSIGNED: Final = TUNING.aimed
_TRIALS: Final = TUNING.trials
_TIE: Final = TUNING.tie
_CONTACT: Final = TUNING.tight


@borrowing
def make_moves(
    search: SearchData,
    plan: Assignment,
    work: Workspace,
    draws: Uint64s,
    num_moves: int,
    stop: Bytes,
) -> None:
    """Make moves on one satellite's part of a plan, in place."""
    m = len(search.rows)
    left_cost = search.network.left_cost
    if left_cost > 0.0:
        # At the cost itself fewer plans are worth the same, and the search gets stuck sooner
        # (docs/bounds.md).
        left_cost *= 2.0 * next_draw(draws)
    for _ in range(num_moves):
        if stop[0] or m == 0:
            break
        low, high = _window(search, plan, _pivot(search, plan, draws), draws)
        left, right = low - 1, high
        while left >= 0 and not plan.is_taken[search.rows[left]]:
            left -= 1
        while right < m and not plan.is_taken[search.rows[right]]:
            right += 1
        energy, data, is_kept_to = _state_after(search, plan, left)
        after = _after(search, plan, right, _data_end(search, plan, high), left_cost)
        if low >= high or not is_kept_to:
            continue
        if search.is_polish:
            _weigh_liking(search, plan, work, low, high, draws)
        else:
            _weigh(search, plan, work, low, high, draws)
        last = best_label(search, work, left, low, high, right, energy, data, after)
        if last != NOWHERE:
            saved = _cost_of(search, plan, low, high, data, after)
            saved -= cost_at_end(after, data if last < 0 else work.data[last])
            _replace(search, plan, work, low, high, last, saved)


@borrowing_inner
def _pivot(search: SearchData, plan: Assignment, draws: Uint64s) -> int:
    """Return a random task, mostly one whose target is not imaged."""
    m = len(search.rows)
    num_trials = _TRIALS if next_draw(draws) < _FOR_UNASSIGNED and not search.is_polish else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * m)
        target = search.target[pivot]
        if plan.imaged_by[target] == UNASSIGNED and search.worth[search.rows[pivot]] > 0.0:
            break
    return pivot


@borrowing_inner
def _window(search: SearchData, plan: Assignment, pivot: int, draws: Uint64s) -> tuple[int, int]:
    """Return the range of tasks around the pivot between two of the plan, a few apart."""
    num_tasks = _FEWEST_TASKS + int(next_draw(draws) * (_MOST_TASKS - _FEWEST_TASKS + 1))
    num_before = int(next_draw(draws) * (num_tasks + 1))
    lowest = max(0, pivot - RESOURCE_WINDOW_NODES // 2)
    highest = min(len(search.rows), pivot + RESOURCE_WINDOW_NODES // 2)
    low, high = pivot, pivot
    count = 0
    while low > lowest:
        if plan.is_taken[search.rows[low - 1]]:
            if count == num_before:
                break
            count += 1
        low -= 1
    count = 0
    while high < highest:
        if plan.is_taken[search.rows[high]]:
            if count == num_tasks - num_before:
                break
            count += 1
        high += 1
    return low, high


@borrowing_inner
def _state_after(search: SearchData, plan: Assignment, last: int) -> tuple[float, float, bool]:
    """Return energy and data after the plan's tasks up to ``last``, and whether limits are kept."""
    network = search.network
    energy, data = network.energy_start, network.data_start
    before = -1
    for k in range(last + 1):
        if not plan.is_taken[search.rows[k]]:
            continue
        if data > network.data_before[k]:
            return energy, data, False
        energy += give_between(network, before, k)
        before = k
        energy = min(energy, network.energy_cap[k]) - network.energy_cost[k]
        data = max(network.data_floor[k], data + network.data_gain[k])
        if energy < network.energy_floor[k] or data > network.data_after[k]:
            return energy, data, False
    return energy, data, True


@borrowing_inner
def _data_end(search: SearchData, plan: Assignment, high: int) -> float:
    """Return the most data that may be left at the end if the tasks from ``high`` on stay.

    It depends on the last image if images must be downlinked; before ``high`` that may be any.
    """
    network = search.network
    if not network.must_deliver:
        return float(network.data_end)
    last = len(search.rows) - 1
    while last >= 0:
        is_possible = last < high or plan.is_taken[search.rows[last]]
        if is_possible and search.worth[search.rows[last]] > 0.0:
            return float(min(network.data_end, network.delivered[last]))
        last -= 1
    return float(network.data_end)


@borrowing_inner
def _after(
    search: SearchData, plan: Assignment, first: int, data_end: float, left_cost: float
) -> After:
    """Return what the plan's tasks from ``first`` on need, and what they do to the data."""
    network = search.network
    need, bears, floor, gain = -np.inf, data_end, -np.inf, 0.0
    k = len(search.rows) - 1
    following = -1
    while k >= first:
        if plan.is_taken[search.rows[k]]:
            charged = give_between(network, k, following) if following >= 0 else 0.0
            need = max(need - charged, network.energy_floor[k]) + network.energy_cost[k]
            following = k
            if need > network.energy_cap[k]:
                return After(np.inf, bears, floor, gain, left_cost)
            bears = min(bears, network.data_after[k])
            if network.data_floor[k] > bears:
                return After(np.inf, bears, floor, gain, left_cost)
            bears = min(network.data_before[k], bears - network.data_gain[k])
            floor = max(floor, network.data_floor[k] + gain)
            gain += network.data_gain[k]
        k -= 1
    return After(need, bears, floor, gain, left_cost)


@borrowing_inner
def _cost_of(
    search: SearchData, plan: Assignment, low: int, high: int, data: float, after: After
) -> float:
    """Return the cost of the data left at the end if the window's tasks stay as they are."""
    network = search.network
    if after.left_cost == 0.0:
        return 0.0
    for k in range(low, high):
        if plan.is_taken[search.rows[k]]:
            data = max(network.data_floor[k], data + network.data_gain[k])
    return cost_at_end(after, data)


@borrowing_inner
def _weigh(
    search: SearchData, plan: Assignment, work: Workspace, low: int, high: int, draws: Uint64s
) -> None:
    """Set the gain of each task of a window, and count how often each target occurs in it.

    Ties are broken at random, so that the search wanders over plans of equal worth; with noise
    also over plans that are worth less.
    """
    move = work.move[0] + 1
    work.move[0] = move
    with_others, noise = next_draw(draws) < 0.5, _TIE + search.noise
    for k in range(low, high):
        at = k - low
        target = search.target[k]
        if search.network.is_contact[k]:
            work.gain[at] = (
                NEVER if search.is_shut[k] else -_CONTACT * search.typical * next_draw(draws)
            )
            continue
        if work.marked_at[target] != move:
            work.marked_at[target] = move
            work.seen[target] = 0
        work.seen[target] += 1
        held = plan.imaged_by[target]
        is_here = held != UNASSIGNED and search.satellite[held] == search.number
        if is_here:
            is_here = low <= search.local[held] < high
        worth = search.worth[search.rows[k]]
        if held == UNASSIGNED or is_here:
            work.gain[at] = worth * (1.0 + noise * next_draw(draws)) if worth > 0.0 else NEVER
        elif with_others and not search.is_locked[target]:
            better = worth - search.worth[held]
            work.gain[at] = better + worth * noise * next_draw(draws)
        else:
            work.gain[at] = NEVER
        if search.network.is_kept[k]:
            work.gain[at] = max(work.gain[at], 0.0)


@borrowing_inner
def _weigh_liking(
    search: SearchData, plan: Assignment, work: Workspace, low: int, high: int, draws: Uint64s
) -> None:
    """Do the same for a polish: worth first, then liking; contacts stay as they are.

    Half of the moves leave out targets that the plan does not image: if a window could earn more
    with them, the best path would never be one that is worth the same.
    """
    move = work.move[0] + 1
    work.move[0] = move
    with_free = next_draw(draws) < 0.5
    slight = SLIGHT * search.typical
    for k in range(low, high):
        at, row = k - low, search.rows[k]
        target = search.target[k]
        if search.network.is_contact[k]:
            work.gain[at] = STAYS * search.typical if plan.is_taken[row] else NEVER
            continue
        if work.marked_at[target] != move:
            work.marked_at[target] = move
            work.seen[target] = 0
        work.seen[target] += 1
        held = plan.imaged_by[target]
        worth, liking = search.worth[row], search.liking[row]
        is_here = held != UNASSIGNED and search.satellite[held] == search.number
        if is_here:
            is_here = low <= search.local[held] < high
        if (held == UNASSIGNED and with_free) or is_here:
            work.gain[at] = worth + slight * (1.0 + liking) if worth > 0.0 else NEVER
        elif held != UNASSIGNED and not search.is_locked[target]:
            work.gain[at] = worth - search.worth[held] + slight * (liking - search.liking[held])
        else:
            work.gain[at] = NEVER
        if search.network.is_kept[k]:
            work.gain[at] = max(work.gain[at], 0.0)


@borrowing_inner
def _replace(
    search: SearchData,
    plan: Assignment,
    work: Workspace,
    low: int,
    high: int,
    last: int,
    saved: float,
) -> None:
    """Replace the window's tasks by a path, unless the plan would lose more than the noise allows.

    Parameters
    ----------
    saved
        By how much the cost of the data left at the end falls.
    """
    site = search.target
    num_new, worth = 0, saved
    liking, num_contacts = 0.0, 0
    label = last
    while label >= 0:
        k = low + label // LABELS_PER_TASK
        work.path[num_new] = k
        num_new += 1
        if not search.network.is_contact[k]:
            held = plan.imaged_by[site[k]]
            worth += search.worth[search.rows[k]]
            liking += search.liking[search.rows[k]]
            if held != UNASSIGNED and not (
                search.satellite[held] == search.number and low <= search.local[held] < high
            ):
                worth -= search.worth[held]
                liking -= search.liking[held]
        else:
            num_contacts += 1
        label = work.source[label]
    num_old = 0
    for k in range(low, high):
        if plan.is_taken[search.rows[k]]:
            work.old[num_old] = k
            num_old += 1
            if not search.network.is_contact[k]:
                worth -= search.worth[search.rows[k]]
                liking -= search.liking[search.rows[k]]
            else:
                num_contacts -= 1
    if worth < -ROUNDING - search.noise * search.typical:
        return
    if search.is_polish and (worth > ROUNDING or liking <= ROUNDING or num_contacts != 0):
        return
    for i in range(num_old):
        k = work.old[i]
        plan.is_taken[search.rows[k]] = False
        if not search.network.is_contact[k]:
            plan.imaged_by[site[k]] = UNASSIGNED
    for i in range(num_new):
        k = work.path[i]
        if not search.network.is_contact[k]:
            held = plan.imaged_by[site[k]]
            if held != UNASSIGNED:
                plan.is_taken[held] = False
            plan.imaged_by[site[k]] = search.rows[k]
        plan.is_taken[search.rows[k]] = True

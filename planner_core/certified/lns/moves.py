"""The moves of the window search: a stretch of one satellite's tasks is replanned.

Between two tasks that stay, the heaviest chain replaces what was there. The chain may also take a
target that is imaged outside the window, at next to no weight: the other image is then dropped,
which makes room elsewhere at no cost.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from planner_core.bundles import bundle
from planner_core.certified.lns.window_chains import Workspace, follows, heaviest_chain
from planner_core.certified.signs import NO_TASK, NOWHERE, UNASSIGNED
from planner_core.certified.sizes import WINDOW_NODES, WINDOW_WORDS
from planner_core.certified.tolerances import SLIGHT
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.network import Network, slews_in
from planner_core.problem import Bools, Bytes, Floats, Ints
from planner_core.problem.slew import TIME_TOLERANCE_S

_FEWEST_TASKS, _MOST_TASKS = TUNING.window_tasks
_FOR_UNASSIGNED: Final = TUNING.aimed
_TRIALS: Final = TUNING.patience
_TIE: Final = TUNING.tie


@bundle
class SearchData(NamedTuple):
    """What moves do not change. Shape ``(n,)``, for the nodes of the network, unless stated.

    Attributes
    ----------
    is_transitive
        Whether dropping any task leaves its neighbours compatible. Shape ``(num_parts,)``.
    preference
        Factor on each target's worth by which the search prefers some targets to others.
        Shape ``(num_targets + 1,)``.
    is_kept
        Nodes that every plan must take.
    is_locked
        Which targets are imaged by a kept task. Shape ``(num_targets + 1,)``.
    kept_worth
        Added to the worth of a kept node: more than all targets together.
    is_alike
        Whether all nodes are worth the same.
    """

    network: Network
    is_transitive: Bools
    worth: Floats
    preference: Floats
    is_kept: Bools
    is_locked: Bools
    kept_worth: float
    is_alike: bool


@bundle
class Assignment(NamedTuple):
    """The plan: the nodes it takes, and the node that images each target (or ``UNASSIGNED``)."""

    is_taken: Bools
    imaged_by: Ints


@borrowing
def make_moves(
    search: SearchData, plan: Assignment, offered: Bools, work: Workspace, draws: Uint64s,
    num_moves: int, stop: Bytes,
) -> None:  # fmt: skip
    """Make moves on a plan, in place.

    Parameters
    ----------
    offered
        Nodes that moves may take besides those that are taken. Shape ``(n,)``.
    """
    if len(search.network.site) == 0:
        return
    for _ in range(num_moves):
        if stop[0]:
            return
        pivot = _pivot(search, plan, offered, draws)
        part = _part_of(search, pivot)
        begin, end = search.network.first[part], search.network.first[part + 1]
        low, high = _window(plan, pivot, begin, end, draws)
        left, right = low - 1, high
        while left >= begin and not plan.is_taken[left]:
            left -= 1
        while right < end and not plan.is_taken[right]:
            right += 1
        # A node that begins before the task on the left ends cannot follow it.
        if left >= begin:
            after_s = search.network.end_s[left] - TIME_TOLERANCE_S
            while low < high and search.network.start_s[low] < after_s:
                low += 1
        if low >= high:
            continue
        num_words = _weigh(search, plan, offered, work, low, high, draws)
        if num_words > WINDOW_WORDS:
            continue
        ends = (left if left >= begin else NO_TASK, right if right < end else NO_TASK)
        last = heaviest_chain(search.network, work, num_words, part, ends, low, high)
        if last != NOWHERE:
            _replace(search, plan, work, low, high, last)


@borrowing_inner
def _pivot(search: SearchData, plan: Assignment, offered: Bools, draws: Uint64s) -> int:
    """Return a random node, mostly one whose target is not imaged."""
    n = len(search.network.site)
    num_trials = _TRIALS if next_draw(draws) < _FOR_UNASSIGNED else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * n)
        target = search.network.site[pivot]
        if offered[pivot] and plan.imaged_by[target] == UNASSIGNED and search.worth[pivot] > 0.0:
            break
    return pivot


@borrowing_inner
def _part_of(search: SearchData, node: int) -> int:
    low, high = 0, len(search.network.first) - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if search.network.first[middle] <= node:
            low = middle
        else:
            high = middle
    return low


@borrowing_inner
def _window(plan: Assignment, pivot: int, begin: int, end: int, draws: Uint64s) -> tuple[int, int]:
    """Return the range of nodes around the pivot between two tasks of the plan, a few apart."""
    num_tasks = _FEWEST_TASKS + int(next_draw(draws) * (_MOST_TASKS - _FEWEST_TASKS + 1))
    num_before = int(next_draw(draws) * (num_tasks + 1))
    lowest, highest = max(begin, pivot - WINDOW_NODES // 2), min(end, pivot + WINDOW_NODES // 2)
    low, high = pivot, pivot
    count = 0
    while low > lowest:
        if plan.is_taken[low - 1]:
            if count == num_before:
                break
            count += 1
        low -= 1
    count = 0
    while high < highest:
        if plan.is_taken[high]:
            if count == num_tasks - num_before:
                break
            count += 1
        high += 1
    return low, high


@borrowing_inner
def _weigh(
    search: SearchData,
    plan: Assignment,
    offered: Bools,
    work: Workspace,
    low: int,
    high: int,
    draws: Uint64s,
) -> int:
    """Set the weights of a window's nodes; return how many 64-bit words a set of its targets takes.

    Only targets that are in the window more than once have a bit in such sets. Ties are broken at
    random, so that the search wanders over plans of equal worth.
    """
    move = work.move[0] + 1
    work.move[0] = move
    tie = _TIE if search.is_alike or move & 1 else SLIGHT
    count = 0
    for node in range(low, high):
        work.weight[node - low] = 0.0
        target, worth = search.network.site[node], search.worth[node]
        if worth <= 0.0 or not (offered[node] or plan.is_taken[node]):
            continue
        held = plan.imaged_by[target]
        is_held_elsewhere = held != UNASSIGNED and not low <= held < high
        if work.marked_at[target] != move:
            work.marked_at[target] = move
            work.number[target] = -1
            if not is_held_elsewhere:
                work.tie[target] = 1.0 + tie * next_draw(draws)
            elif not search.is_locked[target]:
                work.tie[target] = 2.0 * next_draw(draws) - 1.0
        elif work.number[target] < 0:
            work.number[target] = count
            count += 1
        weight = worth * search.preference[target]
        if search.is_locked[target] and not search.is_kept[node]:
            continue
        if not is_held_elsewhere:
            work.weight[node - low] = weight * work.tie[target]
        elif not search.is_locked[target]:
            better = (worth - search.worth[held]) * search.preference[target]
            work.weight[node - low] = better + weight * tie * work.tie[target]
        if search.is_kept[node]:
            work.weight[node - low] += search.kept_worth
    return (count + 63) >> 6


@borrowing_inner
def _replace(
    search: SearchData, plan: Assignment, work: Workspace, low: int, high: int, last: int
) -> None:
    """Replace the window's tasks by a chain, unless the plan would be worth less."""
    num_new, worth = 0, 0.0
    at = last
    while at >= 0:
        k = work.sky.node[at]
        node = low + k
        work.path[num_new] = node
        num_new += 1
        held = plan.imaged_by[search.network.site[node]]
        worth += search.worth[node]
        if held != UNASSIGNED and not low <= held < high:
            worth -= search.worth[held]
        if search.is_kept[node]:
            worth += search.kept_worth
        at = work.source[k]
    num_old = 0
    for node in range(low, high):
        if plan.is_taken[node]:
            work.old[num_old] = node
            num_old += 1
            if plan.imaged_by[search.network.site[node]] == node:
                worth -= search.worth[node]
            if search.is_kept[node]:
                worth -= search.kept_worth
    if worth < -1e-9:
        return
    for i in range(num_old):
        _let_go(search, plan, work.old[i])
    num_dropped = 0
    for i in range(num_new):
        held = plan.imaged_by[search.network.site[work.path[i]]]
        if held != UNASSIGNED:
            work.dropped[num_dropped] = held
            num_dropped += 1
            _let_go(search, plan, held)
        _take(search, plan, work.path[i])
    for i in range(num_dropped):
        if not _is_sound_around(search, plan, work.dropped[i]):
            for j in range(num_new):
                _let_go(search, plan, work.path[j])
            for j in range(num_dropped):
                _take(search, plan, work.dropped[j])
            for j in range(num_old):
                _take(search, plan, work.old[j])
            return


@borrowing_inner
def _take(search: SearchData, plan: Assignment, node: int) -> None:
    plan.is_taken[node] = True
    if plan.imaged_by[search.network.site[node]] == UNASSIGNED:
        plan.imaged_by[search.network.site[node]] = node


@borrowing_inner
def _let_go(search: SearchData, plan: Assignment, node: int) -> None:
    plan.is_taken[node] = False
    if plan.imaged_by[search.network.site[node]] == node:
        plan.imaged_by[search.network.site[node]] = UNASSIGNED


@borrowing_inner
def _is_sound_around(search: SearchData, plan: Assignment, node: int) -> bool:
    """Return whether the tasks around a dropped one are compatible without it."""
    part = _part_of(search, node)
    if search.is_transitive[part]:
        return True
    before, after = node - 1, node + 1
    while before >= search.network.first[part] and not plan.is_taken[before]:
        before -= 1
    while after < search.network.first[part + 1] and not plan.is_taken[after]:
        after += 1
    is_between = before >= search.network.first[part] and after < search.network.first[part + 1]
    network = search.network
    return not is_between or follows(network, slews_in(network, part), before, after)

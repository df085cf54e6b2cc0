"""The moves of the window search: a stretch of one satellite's tasks is planned anew.

Between two tasks that stay, the heaviest chain takes the place of what was there. A target that is
imaged outside the window may be on the chain too, at next to no worth: its other image is then
dropped, which makes room elsewhere for nothing.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from planner_core.bundles import bundle
from planner_core.certified.lns.window_chains import Room, follows, heaviest_chain
from planner_core.certified.signs import FREE, NO_TASK, NOWHERE
from planner_core.certified.sizes import WINDOW_NODES, WINDOW_WORDS
from planner_core.certified.tolerances import SLIGHT
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.network import Network, slews_in
from planner_core.problem import Bools, Bytes, Floats, Ints
from planner_core.problem.slew import TIME_TOLERANCE_S

_FEWEST_TASKS, _MOST_TASKS = TUNING.window_tasks
_FOR_FREE_TARGET: Final = TUNING.aimed
_TRIALS: Final = TUNING.patience
_TIE: Final = TUNING.tie


@bundle
class Ground(NamedTuple):
    """What moves do not change. Shape ``(n,)``, for the nodes of the network, unless said.

    Attributes
    ----------
    is_transitive
        Whether the tasks around one can do without it in any case. Shape ``(num_parts,)``.
    worth
        Of each node.
    preference
        By how much the search prefers a target to others of its worth, as a factor.
        Shape ``(num_targets + 1,)``.
    is_kept
        What every plan must take.
    is_locked
        Which targets are imaged by a kept task. Shape ``(num_targets + 1,)``.
    kept_worth
        More than all targets together.
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
class Taken(NamedTuple):
    """The plan: which nodes it takes, and for each target the node that images it, or ``FREE``."""

    is_taken: Bools
    holder: Ints


@borrowing
def make_moves(
    ground: Ground, taken: Taken, offered: Bools, room: Room, draws: Uint64s, num_moves: int,
    stop: Bytes,
) -> None:  # fmt: skip
    """Make moves on a plan, in place.

    Parameters
    ----------
    offered
        Nodes that moves may take beside those that are taken. Shape ``(n,)``.
    """
    if len(ground.network.place) == 0:
        return
    for _ in range(num_moves):
        if stop[0]:
            return
        pivot = _pivot(ground, taken, offered, draws)
        part = _part_of(ground, pivot)
        begin, end = ground.network.first[part], ground.network.first[part + 1]
        low, high = _window(taken, pivot, begin, end, draws)
        left, right = low - 1, high
        while left >= begin and not taken.is_taken[left]:
            left -= 1
        while right < end and not taken.is_taken[right]:
            right += 1
        # What begins before the task on the left ends is in no chain after it.
        if left >= begin:
            after_s = ground.network.end_s[left] - TIME_TOLERANCE_S
            while low < high and ground.network.start_s[low] < after_s:
                low += 1
        if low >= high:
            continue
        num_words = _weigh(ground, taken, offered, room, low, high, draws)
        if num_words > WINDOW_WORDS:
            continue
        ends = (left if left >= begin else NO_TASK, right if right < end else NO_TASK)
        last = heaviest_chain(ground.network, room, num_words, part, ends, low, high)
        if last != NOWHERE:
            _replace(ground, taken, room, low, high, last)


@borrowing_inner
def _pivot(ground: Ground, taken: Taken, offered: Bools, draws: Uint64s) -> int:
    """Return a node at random, mostly one of a target that is not imaged."""
    n = len(ground.network.place)
    num_trials = _TRIALS if next_draw(draws) < _FOR_FREE_TARGET else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * n)
        target = ground.network.place[pivot]
        if offered[pivot] and taken.holder[target] == FREE and ground.worth[pivot] > 0.0:
            break
    return pivot


@borrowing_inner
def _part_of(ground: Ground, node: int) -> int:
    low, high = 0, len(ground.network.first) - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if ground.network.first[middle] <= node:
            low = middle
        else:
            high = middle
    return low


@borrowing_inner
def _window(taken: Taken, pivot: int, begin: int, end: int, draws: Uint64s) -> tuple[int, int]:
    """Return the nodes between two tasks of the plan, a few tasks apart, around the pivot."""
    num_tasks = _FEWEST_TASKS + int(next_draw(draws) * (_MOST_TASKS - _FEWEST_TASKS + 1))
    num_before = int(next_draw(draws) * (num_tasks + 1))
    lowest, highest = max(begin, pivot - WINDOW_NODES // 2), min(end, pivot + WINDOW_NODES // 2)
    low, high = pivot, pivot
    count = 0
    while low > lowest:
        if taken.is_taken[low - 1]:
            if count == num_before:
                break
            count += 1
        low -= 1
    count = 0
    while high < highest:
        if taken.is_taken[high]:
            if count == num_tasks - num_before:
                break
            count += 1
        high += 1
    return low, high


@borrowing_inner
def _weigh(
    ground: Ground, taken: Taken, offered: Bools, room: Room, low: int, high: int, draws: Uint64s
) -> int:
    """Give a window's nodes weights; return how many words a set of its targets takes.

    Only those targets have a place in such sets that are in the window more than once.

    Ties are broken at random, so that the search wanders over plans of equal worth.
    """
    move = room.move[0] + 1
    room.move[0] = move
    tie = _TIE if ground.is_alike or move & 1 else SLIGHT
    count = 0
    for node in range(low, high):
        room.weight[node - low] = 0.0
        target, worth = ground.network.place[node], ground.worth[node]
        if worth <= 0.0 or not (offered[node] or taken.is_taken[node]):
            continue
        held = taken.holder[target]
        is_held_elsewhere = held != FREE and not low <= held < high
        if room.marked_at[target] != move:
            room.marked_at[target] = move
            room.number[target] = -1
            if not is_held_elsewhere:
                room.tie[target] = 1.0 + tie * next_draw(draws)
            elif not ground.is_locked[target]:
                room.tie[target] = 2.0 * next_draw(draws) - 1.0
        elif room.number[target] < 0:
            room.number[target] = count
            count += 1
        weight = worth * ground.preference[target]
        if ground.is_locked[target] and not ground.is_kept[node]:
            continue
        if not is_held_elsewhere:
            room.weight[node - low] = weight * room.tie[target]
        elif not ground.is_locked[target]:
            better = (worth - ground.worth[held]) * ground.preference[target]
            room.weight[node - low] = better + weight * tie * room.tie[target]
        if ground.is_kept[node]:
            room.weight[node - low] += ground.kept_worth
    return (count + 63) >> 6


@borrowing_inner
def _replace(ground: Ground, taken: Taken, room: Room, low: int, high: int, last: int) -> None:
    """Let a chain take the place of what is in the window, unless the plan is worth less then."""
    num_new, worth = 0, 0.0
    at = last
    while at >= 0:
        k = room.sky.node[at]
        node = low + k
        room.path[num_new] = node
        num_new += 1
        held = taken.holder[ground.network.place[node]]
        worth += ground.worth[node]
        if held != FREE and not low <= held < high:
            worth -= ground.worth[held]
        if ground.is_kept[node]:
            worth += ground.kept_worth
        at = room.source[k]
    num_old = 0
    for node in range(low, high):
        if taken.is_taken[node]:
            room.old[num_old] = node
            num_old += 1
            if taken.holder[ground.network.place[node]] == node:
                worth -= ground.worth[node]
            if ground.is_kept[node]:
                worth -= ground.kept_worth
    if worth < -1e-9:
        return
    for i in range(num_old):
        _let_go(ground, taken, room.old[i])
    num_dropped = 0
    for i in range(num_new):
        held = taken.holder[ground.network.place[room.path[i]]]
        if held != FREE:
            room.dropped[num_dropped] = held
            num_dropped += 1
            _let_go(ground, taken, held)
        _take(ground, taken, room.path[i])
    for i in range(num_dropped):
        if not _is_sound_around(ground, taken, room.dropped[i]):
            for j in range(num_new):
                _let_go(ground, taken, room.path[j])
            for j in range(num_dropped):
                _take(ground, taken, room.dropped[j])
            for j in range(num_old):
                _take(ground, taken, room.old[j])
            return


@borrowing_inner
def _take(ground: Ground, taken: Taken, node: int) -> None:
    taken.is_taken[node] = True
    if taken.holder[ground.network.place[node]] == FREE:
        taken.holder[ground.network.place[node]] = node


@borrowing_inner
def _let_go(ground: Ground, taken: Taken, node: int) -> None:
    taken.is_taken[node] = False
    if taken.holder[ground.network.place[node]] == node:
        taken.holder[ground.network.place[node]] = FREE


@borrowing_inner
def _is_sound_around(ground: Ground, taken: Taken, node: int) -> bool:
    """Return whether the tasks around one that was let go can do without it."""
    part = _part_of(ground, node)
    if ground.is_transitive[part]:
        return True
    before, after = node - 1, node + 1
    while before >= ground.network.first[part] and not taken.is_taken[before]:
        before -= 1
    while after < ground.network.first[part + 1] and not taken.is_taken[after]:
        after += 1
    is_between = before >= ground.network.first[part] and after < ground.network.first[part + 1]
    network = ground.network
    return not is_between or follows(network, slews_in(network, part), before, after)

"""The moves of the window search: a stretch of one satellite's tasks is planned anew.

Between two tasks that stay, the heaviest chain takes the place of what was there. Labels are
those of ``planner_core.precedence.skyline``; beside each lies the set of the targets on its chain
that are in the window more than once, so no target stands on a chain twice. A target that is imaged
outside the window may be on the chain too, at next to no worth: its other image is then dropped,
which makes room elsewhere for nothing.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.certified.signs import FREE, NO_TASK, NOWHERE
from planner_core.certified.sizes import WINDOW_NODES, WINDOW_WORDS
from planner_core.certified.tolerances import SLIGHT
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.network import Network, slews_in
from planner_core.precedence.skyline import (
    NO_LABEL,
    Skyline,
    best_ahead,
    clear,
    insert,
    is_as_good,
    next_label,
    reaches,
    skyline_for,
    top_label,
    value_of,
)
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Longs,
)
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import Slews, Vector, turns_within

_FEWEST_TASKS, _MOST_TASKS = TUNING.window_tasks
_FOR_FREE_TARGET: Final = TUNING.aimed
_TIE: Final = TUNING.tie
_EMPTY: Final = np.uint64(0)


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
    urgency
        How likely a move begins at a target that is not imaged, where one is drawn.
        Shape ``(num_targets + 1,)``.
    num_trials
        How many draws there are for such a target.
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
    urgency: Floats
    num_trials: int
    is_kept: Bools
    is_locked: Bools
    kept_worth: float
    is_alike: bool


@bundle
class Taken(NamedTuple):
    """The plan: which nodes it takes, and for each target the node that images it, or ``FREE``."""

    is_taken: Bools
    holder: Ints


@bundle
class Room(NamedTuple):
    """Working memory of a window; shape ``(WINDOW_NODES + 1,)`` for nodes, from its first on.

    Attributes
    ----------
    sky
        Labels of chains, which stand for nodes.
    value, source
        Of the heaviest chain that ends with each node: weight, and the label before.
    waiting
        Nodes whose labels have not been entered yet, in order of end.
    on_chain
        Sets of targets, a label's after another's. Shape ``(WINDOW_NODES * WINDOW_WORDS,)``.
    number, marked_at, tie
        A target's place in those sets (-1 for none) and by how much it is favoured, as of which
        move. Shape ``(num_targets + 1,)``.
    weight
        Of each node of the window.
    path, old, dropped
        Nodes that a move takes, lets go in the window, and lets go elsewhere.
    move
        Moves so far. Shape ``(1,)``.
    """

    sky: Skyline
    value: Floats
    source: Ints
    waiting: Ints
    on_chain: npt.NDArray[np.uint64]
    number: Ints
    marked_at: Longs
    weight: Floats
    tie: Floats
    path: Ints
    old: Ints
    dropped: Ints
    move: Longs


def room_for(num_targets: int) -> Room:
    """Return working memory for a problem of so many targets."""
    nodes = WINDOW_NODES + 1
    return Room(
        sky=skyline_for(nodes),
        value=np.zeros(nodes),
        source=np.zeros(nodes, dtype=np.int32),
        waiting=np.zeros(nodes, dtype=np.int32),
        on_chain=np.zeros(nodes * WINDOW_WORDS, dtype=np.uint64),
        number=np.zeros(num_targets + 1, dtype=np.int32),
        marked_at=np.zeros(num_targets + 1, dtype=np.int64),
        weight=np.zeros(nodes),
        tie=np.zeros(num_targets + 1),
        path=np.zeros(nodes, dtype=np.int32),
        old=np.zeros(nodes, dtype=np.int32),
        dropped=np.zeros(nodes, dtype=np.int32),
        move=np.zeros(1, dtype=np.int64),
    )


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
        last = _heaviest(ground, room, num_words, part, ends, low, high)
        if last != NOWHERE:
            _replace(ground, taken, room, low, high, last)


@borrowing_inner
def _looks(network: Network, node: int) -> Vector:
    return network.looks[node, 0], network.looks[node, 1], network.looks[node, 2]


@borrowing_inner
def _looked(network: Network, node: int) -> Vector:
    return network.looked[node, 0], network.looked[node, 1], network.looked[node, 2]


@borrowing_inner
def _follows(network: Network, slews: Slews, a: int, b: int) -> bool:
    room_s = network.start_s[b] - network.end_s[a] - slews.settle_s + TIME_TOLERANCE_S
    return turns_within(slews, room_s, _looked(network, a), _looks(network, b))


@borrowing_inner
def _pivot(ground: Ground, taken: Taken, offered: Bools, draws: Uint64s) -> int:
    """Return a node at random, mostly one of a target that is not imaged."""
    n = len(ground.network.place)
    num_trials = ground.num_trials if next_draw(draws) < _FOR_FREE_TARGET else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * n)
        target = ground.network.place[pivot]
        if offered[pivot] and taken.holder[target] == FREE and ground.worth[pivot] > 0.0:
            urgency = ground.urgency[target]
            if urgency >= 1.0 or next_draw(draws) < urgency:
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
def _heaviest(
    ground: Ground, room: Room, num_words: int,
    part: int, ends: tuple[int, int], low: int, high: int,
) -> int:  # fmt: skip
    """Find the heaviest chain between two tasks, or none; return its last label.

    ``NO_LABEL`` where that is no task at all, ``NOWHERE`` where the two tasks cannot do
    without any in between.
    """
    network, sky, (left, right) = ground.network, room.sky, ends
    slews = slews_in(network, part)
    until_s = np.inf
    if right != NO_TASK:
        until_s = network.start_s[right] - slews.settle_s + TIME_TOLERANCE_S
    clear(sky)
    count, num_waiting, entered = 0, 0, 0
    for node in range(low, high):
        target = network.place[node]
        weight = room.weight[node - low]
        if weight <= 0.0 or network.end_s[node] > until_s:
            continue
        start_s = network.start_s[node]
        while entered < num_waiting:
            k = room.waiting[entered]
            if network.end_s[low + k] > start_s - slews.settle_s + TIME_TOLERANCE_S:
                break
            count = _enter(network, room, slews, low, k, count, num_words)
            entered += 1
        at = _best_without(network, room, slews, node, room.number[target], num_words)
        if at == NO_LABEL and left != NO_TASK and not _follows(network, slews, left, node):
            continue
        room.value[node - low] = value_of(sky, at) + weight
        room.source[node - low] = at
        _wait(network, room, low, node - low, entered, num_waiting)
        num_waiting += 1
    while entered < num_waiting:
        count = _enter(network, room, slews, low, room.waiting[entered], count, num_words)
        entered += 1
    if right == NO_TASK:
        return top_label(sky)
    at = best_ahead(sky, network.start_s[right], _looks(network, right), slews)
    if at == NO_LABEL and left != NO_TASK and not _follows(network, slews, left, right):
        return NOWHERE
    return at


@borrowing_inner
def _wait(network: Network, room: Room, low: int, k: int, entered: int, num_waiting: int) -> None:
    """Put a node among those that wait, in order of end."""
    at = num_waiting
    while at > entered and network.end_s[low + room.waiting[at - 1]] > network.end_s[low + k]:
        room.waiting[at] = room.waiting[at - 1]
        at -= 1
    room.waiting[at] = k


@borrowing_inner
def _enter(
    network: Network, room: Room, slews: Slews, low: int, k: int, count: int, num_words: int
) -> int:
    """Enter a node's label, with the targets on its chain; return how many labels there are."""
    node, source, first = low + k, room.source[k], count * num_words
    value, end_s, looked = room.value[k], network.end_s[node], _looked(network, node)
    for i in range(num_words):
        room.on_chain[first + i] = room.on_chain[source * num_words + i] if source >= 0 else _EMPTY
    number = room.number[network.place[node]]
    if number >= 0:
        room.on_chain[first + (number >> 6)] |= np.uint64(1) << np.uint64(number & 63)
    before, at = NO_LABEL, top_label(room.sky)
    while at >= 0 and value_of(room.sky, at) >= value:
        if is_as_good(room.sky, at, end_s, looked, slews) and _is_subset(
            room.on_chain, at * num_words, first, num_words
        ):
            return count
        before, at = at, next_label(room.sky, at)
    insert(room.sky, count, before, value, end_s, looked, k)
    return count + 1


@borrowing_inner
def _is_subset(words: npt.NDArray[np.uint64], one: int, other: int, num_words: int) -> bool:
    more = _EMPTY
    for i in range(num_words):
        more |= words[one + i] & ~words[other + i]
    return bool(more == _EMPTY)


@borrowing_inner
def _best_without(
    network: Network, room: Room, slews: Slews, node: int, number: int, num_words: int
) -> int:
    """Return the best label that a node may follow and whose chain has not got its target."""
    sky, start_s, looks = room.sky, network.start_s[node], _looks(network, node)
    if number < 0:
        return best_ahead(sky, start_s, looks, slews)
    bit = np.uint64(1) << np.uint64(number & 63)
    at = top_label(sky)
    while at >= 0 and (
        room.on_chain[at * num_words + (number >> 6)] & bit
        or not reaches(sky, at, start_s, looks, slews)
    ):
        at = next_label(sky, at)
    return at


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
    return not is_between or _follows(network, slews_in(network, part), before, after)

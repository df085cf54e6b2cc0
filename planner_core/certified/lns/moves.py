"""The moves of the window search: a stretch of one satellite's tasks is planned anew.

Between two tasks that stay, the heaviest chain takes the place of what was there. Each node
keeps one chain, the heaviest that was found, with the set of targets on it; so no target
stands on a chain twice. A target that is imaged outside the window may be on the chain too, at
next to no worth: its other image is then dropped, which makes room elsewhere for nothing.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Longs,
    may_follow,
)

FREE: Final = -1
"""Holder of a target that no task images."""

MAX_NODES: Final = 4096
"""How many nodes a window may span."""

MAX_WORDS: Final = 16
"""How many words the set of a window's targets may take."""

_FEWEST_TASKS: Final = 3
_MORE_TASKS: Final = 12
_FOR_FREE_TARGET: Final = 0.7  # of all moves
_TIE: Final = 0.01  # of a target's worth; a window's together stay below one task
_SMALL_TIE: Final = 1e-5
_NOWHERE: Final = -2
_AT_START: Final = -1


@bundle
class Ground(NamedTuple):
    """What moves do not change; nodes as in ``bounds.network``. Shape ``(n,)`` unless said.

    Attributes
    ----------
    order_near, order_far, order_offset, order_bits
        Which node may follow which, all satellites in one table.
    is_transitive
        Whether a chain may pass through a task without taking it. Shape ``(num_parts,)``.
    worth
        Of each target, and 0 for contacts. Shape ``(num_targets + 1,)``.
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

    place: Ints
    first: Longs
    arc_from: Longs
    before: Ints
    far_from: Ints
    earlier: Ints
    order_near: Ints
    order_far: Ints
    order_offset: Longs
    order_bits: Bytes
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
    """Working memory of a window; shape ``(MAX_NODES + 1,)`` for nodes.

    Attributes
    ----------
    value, source, is_paid
        Of the chain kept by each node: weight, node before, whether it takes the node itself.
    onward
        The node whose chain goes on from here: itself, or one of its access before it.
    far_value, far_node
        The best chain that every node from here on may follow.
    on_chain
        Sets of targets. Shape ``(MAX_NODES * MAX_WORDS,)``.
    number, marked_at
        A target's place in those sets, as of which move. Shape ``(num_targets + 1,)``.
    weight
        Of each target in the sets. Shape ``(MAX_NODES,)``.
    path, old, dropped
        Nodes that a move takes, lets go in the window, and lets go elsewhere.
    move
        Moves so far. Shape ``(1,)``.
    """

    value: Floats
    source: Ints
    is_paid: Bools
    onward: Ints
    far_value: Floats
    far_node: Ints
    on_chain: npt.NDArray[np.uint64]
    number: Ints
    marked_at: Longs
    weight: Floats
    path: Ints
    old: Ints
    dropped: Ints
    move: Longs


def room_for(num_targets: int) -> Room:
    """Return working memory for a problem of so many targets."""
    nodes = MAX_NODES + 1
    return Room(
        value=np.zeros(nodes),
        source=np.zeros(nodes, dtype=np.int32),
        is_paid=np.zeros(nodes, dtype=np.bool_),
        onward=np.zeros(nodes, dtype=np.int32),
        far_value=np.zeros(nodes),
        far_node=np.zeros(nodes, dtype=np.int32),
        on_chain=np.zeros(MAX_NODES * MAX_WORDS, dtype=np.uint64),
        number=np.zeros(num_targets + 1, dtype=np.int32),
        marked_at=np.zeros(num_targets + 1, dtype=np.int64),
        weight=np.zeros(nodes),
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
    if len(ground.place) == 0:
        return
    for _ in range(num_moves):
        if stop[0]:
            return
        pivot = _pivot(ground, taken, offered, draws)
        part = _part_of(ground, pivot)
        begin, end = ground.first[part], ground.first[part + 1]
        low, high = _window(taken, pivot, begin, end, draws)
        left, right = low - 1, high
        while left >= begin and not taken.is_taken[left]:
            left -= 1
        while right < end and not taken.is_taken[right]:
            right += 1
        if left >= begin:
            low = max(low, ground.order_near[left])
        if low >= high:
            continue
        num_words = _weigh(ground, taken, offered, room, low, high, draws)
        if num_words > MAX_WORDS:
            continue
        last = _heaviest(ground, taken, offered, room, num_words, part, left, low, high, right)
        if last != _NOWHERE:
            _replace(ground, taken, room, low, high, last)


@borrowing
def _follows(ground: Ground, a: int, b: int) -> bool:
    return may_follow(
        a, b, ground.order_near, ground.order_far, ground.order_offset, ground.order_bits
    )


@borrowing
def _pivot(ground: Ground, taken: Taken, offered: Bools, draws: Uint64s) -> int:
    """Return a node at random, mostly one of a target that is not imaged."""
    n = len(ground.place)
    num_trials = ground.num_trials if next_draw(draws) < _FOR_FREE_TARGET else 1
    pivot = 0
    for _ in range(num_trials):
        pivot = int(next_draw(draws) * n)
        target = ground.place[pivot]
        if offered[pivot] and taken.holder[target] == FREE and ground.worth[target] > 0.0:
            urgency = ground.urgency[target]
            if urgency >= 1.0 or next_draw(draws) < urgency:
                break
    return pivot


@borrowing
def _part_of(ground: Ground, node: int) -> int:
    low, high = 0, len(ground.first) - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if ground.first[middle] <= node:
            low = middle
        else:
            high = middle
    return low


@borrowing
def _window(taken: Taken, pivot: int, begin: int, end: int, draws: Uint64s) -> tuple[int, int]:
    """Return the nodes between two tasks of the plan, a few tasks apart, around the pivot."""
    num_tasks = _FEWEST_TASKS + int(next_draw(draws) * _MORE_TASKS)
    num_before = int(next_draw(draws) * (num_tasks + 1))
    lowest, highest = max(begin, pivot - MAX_NODES // 2), min(end, pivot + MAX_NODES // 2)
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


@borrowing
def _weigh(
    ground: Ground, taken: Taken, offered: Bools, room: Room, low: int, high: int, draws: Uint64s
) -> int:
    """Give a window's targets numbers and weights; return how many words a set of them takes.

    Ties are broken at random, so that the search wanders over plans of equal worth.
    """
    move = room.move[0] + 1
    room.move[0] = move
    tie = _TIE if ground.is_alike or move & 1 else _SMALL_TIE
    count = 0
    for node in range(low, high):
        target = ground.place[node]
        if room.marked_at[target] == move or ground.worth[target] <= 0.0:
            continue
        if not offered[node] and not taken.is_taken[node]:
            continue
        room.marked_at[target] = move
        room.number[target] = count
        held = taken.holder[target]
        weight = ground.worth[target] * ground.preference[target]
        if held == FREE or low <= held < high:
            room.weight[count] = weight * (1.0 + tie * next_draw(draws))
        elif ground.is_locked[target]:
            room.weight[count] = -1.0
        else:
            room.weight[count] = weight * tie * (2.0 * next_draw(draws) - 1.0)
        count += 1
    return (count + 63) >> 6


@borrowing
def _heaviest(
    ground: Ground, taken: Taken, offered: Bools, room: Room, num_words: int,
    part: int, left: int, low: int, high: int, right: int,
) -> int:  # fmt: skip
    """Find the heaviest chain between two tasks; return its last node less ``low``.

    ``_AT_START`` where that is no task at all, ``_NOWHERE`` where the two tasks cannot do
    without any in between. Nodes in ``room`` count from ``low``.
    """
    begin, end = ground.first[part], ground.first[part + 1]
    is_transitive = ground.is_transitive[part]
    move = room.move[0]
    best, best_at = 0.0, _AT_START
    if left >= begin and right < end and not _follows(ground, left, right):
        best, best_at = -1.0, _NOWHERE
    for k in range(high - low):
        room.far_node[k] = _NOWHERE
    far = _NOWHERE
    for node in range(low, high):
        k = node - low
        if room.far_node[k] != _NOWHERE and (
            far == _NOWHERE or room.value[room.far_node[k]] > room.value[far]
        ):
            far = room.far_node[k]
        room.onward[k] = _NOWHERE
        is_last = right >= end or _follows(ground, node, right)
        earlier = ground.earlier[node]
        if earlier >= low:
            room.onward[k] = room.onward[earlier - low]
        # A path that goes on through here would reach the task on the right as well.
        if is_transitive and not is_last:
            continue
        weight, word, bit = 0.0, 0, np.uint64(0)
        target = ground.place[node]
        if (offered[node] or taken.is_taken[node]) and room.marked_at[target] == move:
            number = room.number[target]
            word, bit = number >> 6, np.uint64(1) << np.uint64(number & 63)
            weight = room.weight[number]
            if ground.is_kept[node]:
                weight += ground.kept_worth
            elif ground.is_locked[target]:
                weight = -1.0
        if weight <= 0.0 and not is_transitive:
            continue
        value, source, is_paid = -1.0, _NOWHERE, False
        if left < begin or _follows(ground, left, node):
            value, source, is_paid = max(weight, 0.0), _AT_START, weight > 0.0
        if far != _NOWHERE:
            is_new = weight > 0.0 and not room.on_chain[far * num_words + word] & bit
            reached = room.value[far] + (weight if is_new else 0.0)
            if reached > value and (is_new or is_transitive):
                value, source, is_paid = reached, far, is_new
        at = ground.arc_from[node + 1] - 1
        while at >= ground.arc_from[node] and ground.before[at] >= low:
            other = room.onward[ground.before[at] - low]
            at -= 1
            if other == _NOWHERE:
                continue
            reached = room.value[other]
            is_new = weight > 0.0 and not room.on_chain[other * num_words + word] & bit
            if is_new:
                reached += weight
            if reached > value and (is_new or is_transitive):
                value, source, is_paid = reached, other, is_new
        if source == _NOWHERE:
            continue
        room.value[k], room.source[k], room.is_paid[k] = value, source, is_paid
        for i in range(num_words):
            room.on_chain[k * num_words + i] = (
                room.on_chain[source * num_words + i] if source >= 0 else np.uint64(0)
            )
        if is_paid:
            room.on_chain[k * num_words + word] |= bit
        if is_last and value > best:
            best, best_at = value, k
        if room.onward[k] == _NOWHERE or room.value[room.onward[k]] < value:
            room.onward[k] = k
        to = ground.far_from[node] - low
        if to < high - low:
            other = room.far_node[to]
            if other == _NOWHERE or room.value[other] < room.value[room.onward[k]]:
                room.far_node[to] = room.onward[k]
    return best_at


@borrowing
def _replace(ground: Ground, taken: Taken, room: Room, low: int, high: int, last: int) -> None:
    """Let a chain take the place of what is in the window, unless the plan is worth less then."""
    num_new, worth = 0, 0.0
    at = last
    while at >= 0:
        if room.is_paid[at]:
            node = low + at
            room.path[num_new] = node
            num_new += 1
            held = taken.holder[ground.place[node]]
            if held == FREE or low <= held < high:
                worth += ground.worth[ground.place[node]]
            if ground.is_kept[node]:
                worth += ground.kept_worth
        at = room.source[at]
    num_old = 0
    for node in range(low, high):
        if taken.is_taken[node]:
            room.old[num_old] = node
            num_old += 1
            if taken.holder[ground.place[node]] == node:
                worth -= ground.worth[ground.place[node]]
            if ground.is_kept[node]:
                worth -= ground.kept_worth
    if worth < -1e-9:
        return
    for i in range(num_old):
        _let_go(ground, taken, room.old[i])
    num_dropped = 0
    for i in range(num_new):
        held = taken.holder[ground.place[room.path[i]]]
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


@borrowing
def _take(ground: Ground, taken: Taken, node: int) -> None:
    taken.is_taken[node] = True
    if taken.holder[ground.place[node]] == FREE:
        taken.holder[ground.place[node]] = node


@borrowing
def _let_go(ground: Ground, taken: Taken, node: int) -> None:
    taken.is_taken[node] = False
    if taken.holder[ground.place[node]] == node:
        taken.holder[ground.place[node]] = FREE


@borrowing
def _is_sound_around(ground: Ground, taken: Taken, node: int) -> bool:
    """Return whether the tasks around one that was let go can do without it."""
    part = _part_of(ground, node)
    if ground.is_transitive[part]:
        return True
    before, after = node - 1, node + 1
    while before >= ground.first[part] and not taken.is_taken[before]:
        before -= 1
    while after < ground.first[part + 1] and not taken.is_taken[after]:
        after += 1
    is_between = before >= ground.first[part] and after < ground.first[part + 1]
    return not is_between or _follows(ground, before, after)

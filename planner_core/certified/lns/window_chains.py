"""The heaviest chain of tasks in a window that takes no target twice.

Labels are those of ``planner_core.precedence.skyline``, each with the set of the targets on its
chain that are in the window more than once.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.certified.signs import NO_TASK, NOWHERE
from planner_core.certified.sizes import WINDOW_NODES, WINDOW_WORDS
from planner_core.jit import borrowing_inner
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
from planner_core.problem import Floats, Ints, Longs
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import Slews, Vector, turns_within

_EMPTY: Final = np.uint64(0)


@bundle
class Workspace(NamedTuple):
    """Working memory of a window; shape ``(WINDOW_NODES + 1,)`` for nodes, from its first on.

    Attributes
    ----------
    sky
        Labels of chains, each by its last node.
    value, source
        Of the heaviest chain that ends with each node: weight, and the label before.
    waiting
        Nodes whose labels have not been entered yet, in order of end.
    on_chain
        Sets of targets, one label's after another's.
        Shape ``((WINDOW_NODES + 1) * WINDOW_WORDS,)``.
    number, marked_at, tie
        Each target's bit in those sets (-1 for none), the move as of which it holds, and the
        target's random factor for ties. Shape ``(num_targets + 1,)``.
    weight
        Of each node of the window.
    path, old, dropped
        Nodes that a move takes, drops in the window, and drops elsewhere.
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


def workspace_for(num_targets: int) -> Workspace:
    """Return working memory for a problem with ``num_targets`` targets."""
    nodes = WINDOW_NODES + 1
    return Workspace(
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


@borrowing_inner
def _looks(network: Network, node: int) -> Vector:
    return network.looks[node, 0], network.looks[node, 1], network.looks[node, 2]


@borrowing_inner
def _looked(network: Network, node: int) -> Vector:
    return network.looked[node, 0], network.looked[node, 1], network.looked[node, 2]


@borrowing_inner
def follows(network: Network, slews: Slews, a: int, b: int) -> bool:
    """Return whether a satellite can slew from one node to another in the time between them."""
    room_s = network.start_s[b] - network.end_s[a] - slews.settle_s + TIME_TOLERANCE_S
    return turns_within(slews, room_s, _looked(network, a), _looks(network, b))


@borrowing_inner
def heaviest_chain(
    network: Network, work: Workspace, num_words: int,
    part: int, ends: tuple[int, int], low: int, high: int,
) -> int:  # fmt: skip
    """Find the heaviest chain between two tasks; return its last label.

    ``NO_LABEL`` if the chain is empty, ``NOWHERE`` if there is none, as the two tasks are not
    compatible without one in between.
    """
    sky, (left, right) = work.sky, ends
    slews = slews_in(network, part)
    until_s = np.inf
    if right != NO_TASK:
        until_s = network.start_s[right] - slews.settle_s + TIME_TOLERANCE_S
    clear(sky)
    count, num_waiting, entered = 0, 0, 0
    for node in range(low, high):
        target = network.site[node]
        weight = work.weight[node - low]
        if weight <= 0.0 or network.end_s[node] > until_s:
            continue
        start_s = network.start_s[node]
        while entered < num_waiting:
            k = work.waiting[entered]
            if network.end_s[low + k] > start_s - slews.settle_s + TIME_TOLERANCE_S:
                break
            count = _enter(network, work, slews, low, k, count, num_words)
            entered += 1
        at = _best_without(network, work, slews, node, work.number[target], num_words)
        if at == NO_LABEL and left != NO_TASK and not follows(network, slews, left, node):
            continue
        work.value[node - low] = value_of(sky, at) + weight
        work.source[node - low] = at
        _wait(network, work, low, node - low, entered, num_waiting)
        num_waiting += 1
    while entered < num_waiting:
        count = _enter(network, work, slews, low, work.waiting[entered], count, num_words)
        entered += 1
    if right == NO_TASK:
        return top_label(sky)
    at = best_ahead(sky, network.start_s[right], _looks(network, right), slews)
    if at == NO_LABEL and left != NO_TASK and not follows(network, slews, left, right):
        return NOWHERE
    return at


@borrowing_inner
def _wait(
    network: Network, work: Workspace, low: int, k: int, entered: int, num_waiting: int
) -> None:
    """Insert a node into the waiting ones, in order of end."""
    at = num_waiting
    while at > entered and network.end_s[low + work.waiting[at - 1]] > network.end_s[low + k]:
        work.waiting[at] = work.waiting[at - 1]
        at -= 1
    work.waiting[at] = k


@borrowing_inner
def _enter(
    network: Network,
    work: Workspace,
    slews: Slews,
    low: int,
    k: int,
    count: int,
    num_words: int,
) -> int:
    """Enter a node's label, with the targets on its chain; return how many labels there are."""
    node, source, first = low + k, work.source[k], count * num_words
    value, end_s, looked = work.value[k], network.end_s[node], _looked(network, node)
    for i in range(num_words):
        work.on_chain[first + i] = work.on_chain[source * num_words + i] if source >= 0 else _EMPTY
    number = work.number[network.site[node]]
    if number >= 0:
        work.on_chain[first + (number >> 6)] |= np.uint64(1) << np.uint64(number & 63)
    before, at = NO_LABEL, top_label(work.sky)
    while at >= 0 and value_of(work.sky, at) >= value:
        if is_as_good(work.sky, at, end_s, looked, slews) and _is_subset(
            work.on_chain, at * num_words, first, num_words
        ):
            return count
        before, at = at, next_label(work.sky, at)
    insert(work.sky, count, before, value, end_s, looked, k)
    return count + 1


@borrowing_inner
def _is_subset(words: npt.NDArray[np.uint64], one: int, other: int, num_words: int) -> bool:
    more = _EMPTY
    for i in range(num_words):
        more |= words[one + i] & ~words[other + i]
    return bool(more == _EMPTY)


@borrowing_inner
def _best_without(
    network: Network, work: Workspace, slews: Slews, node: int, number: int, num_words: int
) -> int:
    """Return the best label that a node may follow and whose chain does not hold its target."""
    sky, start_s, looks = work.sky, network.start_s[node], _looks(network, node)
    if number < 0:
        return best_ahead(sky, start_s, looks, slews)
    bit = np.uint64(1) << np.uint64(number & 63)
    at = top_label(sky)
    while at >= 0 and (
        work.on_chain[at * num_words + (number >> 6)] & bit
        or not reaches(sky, at, start_s, looks, slews)
    ):
        at = next_label(sky, at)
    return at

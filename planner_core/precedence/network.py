"""All satellites' tasks as one network of what may follow what, for longest paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import kernel
from planner_core.precedence.arcs import (
    Arcs,
    covering_arcs,
    near_arcs,
    reversed_arcs,
    waiting,
)
from planner_core.precedence.relation import order_of, transitive_closure
from planner_core.problem import (
    COLLECT,
    Floats,
    Ints,
    Longs,
    Problem,
)


@bundle
class Network(NamedTuple):
    """The tasks of all satellites, one satellite after another, each in order of start.

    A path is a sequence of tasks of one satellite that may follow each other directly. Where
    that relation is transitive only covering arcs are kept (those that no third task can
    split), for a path may pass through a task without being paid. Where an access offers
    several collects, what may follow a later one may follow an earlier one too: the path then
    waits, and arcs from the earlier one to what follows the later one are left out.

    Attributes
    ----------
    row
        Row of each node in the table of opportunities. Shape ``(n,)``.
    place
        Target of each node; of a contact, one past the last target. Shape ``(n,)``.
    first
        Where each part's nodes begin. A satellite's tasks fall into parts where a pause is
        longer than any slew: paths before and after it do not mind each other.
        Shape ``(num_parts + 1,)``.
    arc_from, before
        Predecessors of node ``b``: ``before[arc_from[b]:arc_from[b + 1]]``.
    far_from
        From here on every node of the satellite may follow the node; where its part ends, at
        most. Shape ``(n,)``.
    earlier
        The collect before in the same access, from which a path may wait for what follows the
        node; -1 for none. Shape ``(n,)``.
    """

    row: Ints
    place: Ints
    first: Longs
    arc_from: Longs
    before: Ints
    far_from: Ints
    earlier: Ints


def network_of(problem: Problem) -> Network:
    """Return the network of a problem."""
    table = problem.opportunities
    nothing = np.empty(0, dtype=np.int32)
    row, before, far_from, earlier = [nothing], [nothing], [nothing], [nothing]
    first, arc_from = [np.zeros(1, dtype=np.int64)], [np.zeros(1, dtype=np.int64)]
    base = num_arcs = 0
    for satellite in problem.satellites:
        order = order_of(satellite.transitions)
        is_transitive = transitive_closure(problem, satellite) is satellite.transitions
        later = waiting(order, table.access[satellite.rows])
        arcs = covering_arcs(order, later) if is_transitive else near_arcs(order)
        ends = _part_ends(order.far_from)
        part = np.searchsorted(ends, np.arange(len(satellite)), side="right")
        offsets, rows = reversed_arcs(_within(arcs, part))
        own = np.full(len(satellite), -1, dtype=np.int32)
        waits = np.flatnonzero(later >= 0)
        waits = waits[part[waits] == part[later[waits]]]
        own[later[waits]] = waits + base
        row.append(satellite.rows)
        first.append(base + ends)
        arc_from.append(num_arcs + offsets[1:])
        before.append(rows + np.int32(base))
        far_from.append(order.far_from + np.int32(base))
        earlier.append(own)
        base += len(satellite)
        num_arcs += len(rows)
    rows = np.concatenate(row)
    is_collect = table.kind[rows] == COLLECT
    return Network(
        row=rows,
        place=np.where(is_collect, table.place[rows], len(problem.target_ids)).astype(np.int32),
        first=np.concatenate(first),
        arc_from=np.concatenate(arc_from),
        before=np.concatenate(before),
        far_from=np.concatenate(far_from),
        earlier=np.concatenate(earlier),
    )


def _part_ends(far_from: Ints) -> Longs:
    """Return where parts of a satellite's tasks end, each of them followed by all that is after."""
    ends = np.arange(1, len(far_from) + 1, dtype=np.int64)
    return ends[np.maximum.accumulate(far_from) <= ends]


def _within(arcs: Arcs, part: Longs) -> Arcs:
    """Return the arcs that do not lead from part to part."""
    is_within = np.repeat(part, np.diff(arcs.first)) == part[arcs.to]
    count = np.concatenate([[0], np.cumsum(is_within)])
    return Arcs(count[arcs.first].astype(np.int64), arcs.to[is_within])


@kernel
def heaviest_paths(
    network: Network, weight: Floats, value: Floats, previous: Ints, ends: Ints
) -> float:
    """Find each part's heaviest path; return the sum of their weights.

    Parameters
    ----------
    weight
        Worth of each node, not negative. Shape ``(n,)``.
    value, previous
        Filled with the weight of the heaviest path that ends with each node, and with the
        node ahead of it there, or -1. Shape ``(n,)``.
    ends
        Filled with the last node of each part's path, or -1. Shape ``(num_parts,)``.
    """
    total = 0.0
    for part in range(len(network.first) - 1):
        worth, ends[part] = heaviest_path(network, part, weight, value, previous)
        total += worth
    return total


@kernel
def heaviest_path(
    network: Network, part: int, weight: Floats, value: Floats, previous: Ints
) -> tuple[float, int]:
    """Return the weight of one part's heaviest path, and its last node or -1.

    The arrays are those of ``heaviest_paths``, of which only the part's own nodes count.
    """
    begin, end = network.first[part], network.first[part + 1]
    m = end - begin
    far_value = np.zeros(m + 1)
    far_node = np.full(m + 1, -1, dtype=np.int32)
    onward = np.empty(m)  # of the heaviest path that ends with each node or waits until then
    waits_at = np.empty(m, dtype=np.int32)
    far, far_at = 0.0, -1
    best, best_at = 0.0, -1
    for b in range(begin, end):
        if far_value[b - begin] > far:
            far, far_at = far_value[b - begin], far_node[b - begin]
        reached, at = far, far_at
        for i in range(network.arc_from[b], network.arc_from[b + 1]):
            a = network.before[i]
            if onward[a - begin] > reached:
                reached, at = onward[a - begin], a
        value[b] = reached + weight[b]
        previous[b] = waits_at[at - begin] if at >= 0 else -1
        if value[b] > best:
            best, best_at = value[b], b
        onward[b - begin], waits_at[b - begin] = value[b], b
        a = network.earlier[b]
        if a >= 0 and onward[a - begin] >= value[b]:
            onward[b - begin], waits_at[b - begin] = onward[a - begin], waits_at[a - begin]
        to = network.far_from[b] - begin
        if onward[b - begin] > far_value[to]:
            far_value[to] = onward[b - begin]
            far_node[to] = b
    return best, best_at


@kernel
def _heaviest_onward(network: Network, weight: Floats, value: Floats) -> None:
    """Fill in the weight of the heaviest path that begins with each node."""
    value[:] = 0.0  # of what follows, until the node's turn has come
    suffix = np.zeros(len(weight) + 1)
    for s in range(len(network.first) - 1):
        begin, end = network.first[s], network.first[s + 1]
        suffix[end] = 0.0
        for b in range(end - 1, begin - 1, -1):
            follows = max(value[b], suffix[network.far_from[b]])
            a = network.earlier[b]
            if a >= 0:
                value[a] = max(value[a], follows)
            value[b] = follows + weight[b]
            suffix[b] = max(suffix[b + 1], value[b])
            for i in range(network.arc_from[b], network.arc_from[b + 1]):
                a = network.before[i]
                value[a] = max(value[a], value[b])


@kernel
def heaviest_through(network: Network, weight: Floats) -> tuple[float, Floats]:
    """Return the sum of the heaviest paths, and the same where each node must be on a path."""
    n = len(weight)
    through, onward = np.empty(n), np.empty(n)
    previous = np.empty(n, dtype=np.int32)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)
    total = heaviest_paths(network, weight, through, previous, ends)
    _heaviest_onward(network, weight, onward)
    for s in range(len(ends)):
        others = total - (through[ends[s]] if ends[s] >= 0 else 0.0)
        for a in range(network.first[s], network.first[s + 1]):
            through[a] += others + onward[a] - weight[a]
    return total, through

"""All satellites' tasks as one network of what may follow what, for longest paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.arcs import covering_arcs, near_arcs, reversed_arcs
from planner_core.comparable import order_of, transitive_closure
from planner_core.jit import kernel
from planner_core.problem import COLLECT, Floats, Ints, Longs, Problem


class Network(NamedTuple):
    """The tasks of all satellites, one satellite after another, each in order of start.

    A path is a sequence of tasks of one satellite that may follow each other directly. Where
    that relation is transitive only covering arcs are kept (those that no third task can
    split), for a path may pass through a task without being paid.

    Attributes
    ----------
    row
        Row of each node in the table of opportunities. Shape ``(n,)``.
    place
        Target of each node; of a contact, one past the last target. Shape ``(n,)``.
    first
        Where each satellite's nodes begin. Shape ``(num_satellites + 1,)``.
    arc_from, before
        Predecessors of node ``b``: ``before[arc_from[b]:arc_from[b + 1]]``.
    far_from
        From here on every node of the satellite may follow the node. Shape ``(n,)``.
    """

    row: Ints
    place: Ints
    first: Longs
    arc_from: Longs
    before: Ints
    far_from: Ints


def network_of(problem: Problem) -> Network:
    """Return the network of a problem."""
    table = problem.opportunities
    first = [0]
    num_arcs = 0
    arc_from, before, far_from = [np.zeros(1, dtype=np.int64)], [], []
    for satellite in problem.satellites:
        base = first[-1]
        order = order_of(satellite.transitions)
        is_transitive = transitive_closure(problem, satellite) is satellite.transitions
        offsets, rows = reversed_arcs(covering_arcs(order) if is_transitive else near_arcs(order))
        arc_from.append(offsets[1:] + num_arcs)
        num_arcs += len(rows)
        before.append(rows + np.int32(base))
        far_from.append(satellite.transitions.far_from + np.int32(base))
        first.append(base + len(satellite))
    row = np.concatenate([np.empty(0, dtype=np.int32), *(s.rows for s in problem.satellites)])
    is_collect = table.kind[row] == COLLECT
    return Network(
        row=row,
        place=np.where(is_collect, table.place[row], len(problem.target_ids)).astype(np.int32),
        first=np.array(first, dtype=np.int64),
        arc_from=np.concatenate(arc_from),
        before=np.concatenate([np.empty(0, dtype=np.int32), *before]),
        far_from=np.concatenate([np.empty(0, dtype=np.int32), *far_from]),
    )


@kernel
def heaviest_paths(
    network: Network, weight: Floats, value: Floats, previous: Ints, ends: Ints
) -> float:
    """Find each satellite's heaviest path; return the sum of their weights.

    Parameters
    ----------
    weight
        Worth of each node, not negative. Shape ``(n,)``.
    value, previous
        Filled with the weight of the heaviest path that ends with each node, and with the
        node ahead of it there, or -1. Shape ``(n,)``.
    ends
        Filled with the last node of each satellite's path, or -1. Shape ``(num_satellites,)``.
    """
    n = len(weight)
    far_value = np.zeros(n + 1)
    far_node = np.full(n + 1, -1, dtype=np.int32)
    total = 0.0
    for s in range(len(network.first) - 1):
        begin, end = network.first[s], network.first[s + 1]
        far, far_at = 0.0, -1
        far_value[begin] = 0.0
        best, best_at = 0.0, -1
        for b in range(begin, end):
            if far_value[b] > far:
                far, far_at = far_value[b], far_node[b]
            reached, at = far, far_at
            for i in range(network.arc_from[b], network.arc_from[b + 1]):
                a = network.before[i]
                if value[a] > reached:
                    reached, at = value[a], a
            value[b] = reached + weight[b]
            previous[b] = at
            if value[b] > best:
                best, best_at = value[b], b
            to = network.far_from[b]
            if value[b] > far_value[to]:
                far_value[to] = value[b]
                far_node[to] = b
        ends[s] = best_at
        total += best
    return total


@kernel
def _heaviest_onward(network: Network, weight: Floats, value: Floats) -> None:
    """Fill in the weight of the heaviest path that begins with each node."""
    value[:] = 0.0
    suffix = np.zeros(len(weight) + 1)
    for s in range(len(network.first) - 1):
        begin, end = network.first[s], network.first[s + 1]
        suffix[end] = 0.0
        for b in range(end - 1, begin - 1, -1):
            value[b] = max(value[b], suffix[network.far_from[b]]) + weight[b]
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

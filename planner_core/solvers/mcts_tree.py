"""The tree of a Monte Carlo search, in flat arrays.

States reached along different paths almost never coincide, because the images taken are part
of the state. The hash table of the listing is therefore a tree; after each step the branch
that was taken is kept with its estimates.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.problem import Floats, Ints

UNSEEN: Final = -1
ROLLED_OUT: Final = -2
"""In place of a first edge: the state has been met once, but A(s) has not been entered."""


@bundle
class Tree(NamedTuple):
    """States and actions of the search, both numbered in order of appearance.

    A node's actions are contiguous from ``first_edge[node]`` on, which is ``UNSEEN`` or
    ``ROLLED_OUT`` before they are entered; ``child`` of an edge is its node, or ``UNSEEN``.
    Shape ``(num_nodes,)`` and ``(num_edges,)``; ``used`` counts both.
    """

    cursor: Ints
    last: Ints
    battery: Floats
    recorder: Floats
    first_edge: Ints
    num_edges: Ints
    action: Ints
    child: Ints
    visits: Ints
    value: Floats
    used: Ints


@borrowing
def new_node(tree: Tree, cursor: int, last: int, battery: float, recorder: float) -> int:
    """Add a state and return its number."""
    node = int(tree.used[0])
    tree.used[0] += 1
    tree.cursor[node] = cursor
    tree.last[node] = last
    tree.battery[node] = battery
    tree.recorder[node] = recorder
    tree.first_edge[node] = UNSEEN
    tree.num_edges[node] = 0
    return node


@borrowing_inner
def new_edge(tree: Tree, node: int, action: int) -> None:
    """Add an action at the end of those of ``node``, with N = Q = 0."""
    edge = tree.used[1]
    tree.used[1] += 1
    tree.num_edges[node] += 1
    tree.action[edge] = action
    tree.child[edge] = UNSEEN
    tree.visits[edge] = 0
    tree.value[edge] = 0.0


@borrowing_inner
def has_room(tree: Tree, breadth: int) -> bool:
    """Return whether a state below the root may be added or expanded.

    The roots of this step and of the next always have room for A(s) and the states it leads to.
    """
    nodes_left = len(tree.cursor) - int(tree.used[0])
    actions_left = len(tree.action) - int(tree.used[1])
    return nodes_left >= breadth + 3 and actions_left >= 2 * (breadth + 2)


@borrowing_inner
def choose(tree: Tree, node: int, exploration: float) -> int:
    """Return the edge of greatest upper confidence bound (line 11); untried ones come first."""
    first = int(tree.first_edge[node])
    total = 0
    for edge in range(first, first + tree.num_edges[node]):
        if tree.visits[edge] == 0:
            return edge
        total += tree.visits[edge]
    best, best_value = first, -np.inf
    log_total = np.log(total)
    for edge in range(first, first + tree.num_edges[node]):
        bound = tree.value[edge] + exploration * np.sqrt(log_total / tree.visits[edge])
        if bound > best_value:
            best, best_value = edge, bound
    return best


@kernel
def copy_branch(old: Tree, new: Tree, root: int) -> None:
    """Copy ``root`` of ``old``, with all that is below it, to node 0 of ``new``."""
    new.used[0] = 0
    new.used[1] = 0
    waiting = np.empty(old.used[0] + 1, dtype=np.int32)
    waiting[0] = root
    new_node(new, old.cursor[root], old.last[root], old.battery[root], old.recorder[root])
    done = 0
    while done < new.used[0]:
        source = waiting[done]
        first = old.first_edge[source]
        new.first_edge[done] = first if first < 0 else new.used[1]
        for edge in range(first, first + old.num_edges[source]):
            to = new.used[1]
            new_edge(new, done, old.action[edge])
            new.visits[to] = old.visits[edge]
            new.value[to] = old.value[edge]
            child = old.child[edge]
            if child != UNSEEN:
                waiting[new.used[0]] = child
                new.child[to] = new_node(
                    new, old.cursor[child], old.last[child], old.battery[child],
                    old.recorder[child],
                )  # fmt: skip
        done += 1


def empty_tree(num_nodes: int, num_edges: int) -> Tree:
    """Return a tree with room for so many states and actions."""
    nodes = [np.empty(num_nodes, dtype=np.int32) for _ in range(4)]
    edges = [np.empty(num_edges, dtype=np.int32) for _ in range(3)]
    return Tree(
        cursor=nodes[0],
        last=nodes[1],
        battery=np.empty(num_nodes),
        recorder=np.empty(num_nodes),
        first_edge=nodes[2],
        num_edges=nodes[3],
        action=edges[0],
        child=edges[1],
        visits=edges[2],
        value=np.empty(num_edges),
        used=np.zeros(2, dtype=np.int32),
    )

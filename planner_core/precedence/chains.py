"""Longest paths through the tasks of one satellite.

Where "may follow" is transitive, they run on the arcs of its Hasse diagram; for a satellite
that turns more slowly than it tracks, on the whole table of what may follow what.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.jit import kernel
from planner_core.precedence.arcs import Arcs, covering_arcs
from planner_core.precedence.relation import Order, order_of, transitive_closure
from planner_core.problem import (
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Links:
    """What may follow what among one satellite's tasks, ready for longest paths.

    Attributes
    ----------
    arcs
        None where "may follow" is not transitive.
    """

    order: Order
    arcs: Arcs | None

    @classmethod
    def of(cls, problem: Problem, satellite: SatelliteProblem) -> Links:
        """Return the links of one satellite."""
        order = order_of(satellite.transitions)
        is_transitive = transitive_closure(problem, satellite) is satellite.transitions
        arcs = covering_arcs(order) if is_transitive else None
        return cls(order=order, arcs=arcs)

    @property
    def num_steps(self) -> int:
        """How many pairs of tasks one longest path looks at."""
        return int(self.order.offset[-1]) if self.arcs is None else len(self.arcs.to)

    def longest(self, weight: Floats) -> tuple[float, list[int]]:
        """Return the heaviest chain: its weight, and its tasks in order of time."""
        before = np.full(len(weight), -1, dtype=np.int32)
        if self.arcs is None:
            value, task = longest_chain(weight, self.order, before)
        else:
            value, task = longest_path(weight, self.arcs, before)
        return value, _chain_to(task, before)

    def longest_with_history(self, weight: Floats, place: Ints) -> list[int]:
        """Return the tasks of a heavy chain in which no place stands twice."""
        before = np.full(len(weight), -1, dtype=np.int32)
        if self.arcs is None:
            _, task = longest_chain_with_history(weight, place, self.order, before)
        else:
            _, task = longest_path_with_history(weight, place, self.arcs, before)
        return _chain_to(task, before)


@kernel
def longest_path(weight: Floats, arcs: Arcs, before: Ints) -> tuple[float, int]:
    """Return the greatest weight of a chain of tasks that may follow each other, and its end.

    Parameters
    ----------
    weight
        Worth of each task, not negative; tasks worth 0 are passed over. Shape ``(m,)``.
    before
        Filled with the task before each on its best chain, or -1. Shape ``(m,)``.
    """
    m = len(weight)
    value = np.zeros(m)  # of the best chain that ends here or, passing over the task, before
    last = np.full(m, -1, dtype=np.int32)
    best, best_task = 0.0, -1
    for a in range(m):
        if weight[a] > 0.0:
            before[a] = last[a]
            value[a] += weight[a]
            last[a] = a
            if value[a] > best:
                best, best_task = value[a], a
        for at in range(arcs.first[a], arcs.first[a + 1]):
            b = arcs.to[at]
            if value[a] > value[b]:
                value[b] = value[a]
                last[b] = last[a]
    return best, best_task


@kernel
def longest_path_with_history(
    weight: Floats, place: Ints, arcs: Arcs, before: Ints
) -> tuple[float, int]:
    """Return the weight and end of a heavy chain in which no place stands twice.

    Each task hands on the heaviest chain that ends with it or before it, and the set of places
    on that chain; a chain that holds a task's place already goes past the task. This is a
    heuristic: the best chain to a task need not be part of the best chain through it.

    Parameters
    ----------
    weight, place
        Worth of each task, not negative; where it happens. Shape ``(m,)``.
    before
        Filled with the task before each on its chain, or -1. Shape ``(m,)``.
    """
    m = len(weight)
    num_words = 1
    for a in range(m):
        if weight[a] > 0.0:
            num_words = max(num_words, (place[a] >> 6) + 1)
    history = np.zeros((m, num_words), dtype=np.uint64)
    value = np.zeros(m)
    passed = np.full(m, -1, dtype=np.int32)  # where the heaviest chain comes from
    fitting = np.full(m, -1, dtype=np.int32)  # and the heaviest without this task's place
    last = np.full(m, -1, dtype=np.int32)
    best, best_task = 0.0, -1
    for a in range(m):
        total = value[fitting[a]] if fitting[a] >= 0 else 0.0
        other = value[passed[a]] if passed[a] >= 0 else 0.0
        if weight[a] > 0.0 and total + weight[a] >= other:
            source = fitting[a]
            if source >= 0:
                history[a] = history[source]
                before[a] = last[source]
            else:
                before[a] = -1
            history[a, place[a] >> 6] |= np.uint64(1) << np.uint64(place[a] & 63)
            value[a] = total + weight[a]
            last[a] = a
            if value[a] > best:
                best, best_task = value[a], a
        elif passed[a] >= 0:
            history[a] = history[passed[a]]
            value[a] = other
            last[a] = last[passed[a]]
        for at in range(arcs.first[a], arcs.first[a + 1]):
            b = arcs.to[at]
            if passed[b] < 0 or value[a] > value[passed[b]]:
                passed[b] = a
            if fitting[b] >= 0 and value[a] <= value[fitting[b]]:
                continue
            if weight[b] > 0.0 and not (
                history[a, place[b] >> 6] & (np.uint64(1) << np.uint64(place[b] & 63))
            ):
                fitting[b] = a
    return best, best_task


@kernel
def longest_chain(weight: Floats, order: Order, before: Ints) -> tuple[float, int]:
    """Return what ``longest_path`` does, on the table of all pairs."""
    near_from, far_from, offset, bits = order
    m = len(weight)
    value = np.zeros(m)
    # Beyond the longest slew everything may follow: only the best so far counts there.
    far_value = np.zeros(m + 1)
    far_task = np.full(m + 1, -1, dtype=np.int32)
    best_far, best_far_task = 0.0, -1
    best, best_task = 0.0, -1
    for a in range(m):
        if far_value[a] > best_far:
            best_far, best_far_task = far_value[a], far_task[a]
        if weight[a] <= 0.0:
            continue
        if best_far > value[a]:
            value[a] = best_far
            before[a] = best_far_task
        elif value[a] == 0.0:
            before[a] = -1
        value[a] += weight[a]
        if value[a] > best:
            best, best_task = value[a], a
        for b in range(near_from[a], far_from[a]):
            bit = offset[a] + b - near_from[a]
            if (bits[bit >> 3] >> (bit & 7)) & 1 and value[a] > value[b]:
                value[b] = value[a]
                before[b] = a
        if value[a] > far_value[far_from[a]]:
            far_value[far_from[a]] = value[a]
            far_task[far_from[a]] = a
    return best, best_task


@kernel
def longest_chain_with_history(
    weight: Floats, place: Ints, order: Order, before: Ints
) -> tuple[float, int]:
    """Return what ``longest_path_with_history`` does, on the table of all pairs."""
    near_from, far_from, offset, bits = order
    m = len(weight)
    num_words = 1
    for a in range(m):
        if weight[a] > 0.0:
            num_words = max(num_words, (place[a] >> 6) + 1)
    history = np.zeros((m, num_words), dtype=np.uint64)
    reached = np.zeros(m)
    # Tasks by falling weight of their chains, among those that everything from here may follow.
    far = np.empty(m, dtype=np.int32)
    num_far, next_far = 0, 0
    in_order_of_far = np.argsort(far_from, kind="mergesort")
    best, best_task = 0.0, -1
    for b in range(m):
        while next_far < m and far_from[in_order_of_far[next_far]] <= b:
            a = in_order_of_far[next_far]
            next_far += 1
            if weight[a] <= 0.0:
                continue
            at = num_far
            while at > 0 and reached[far[at - 1]] < reached[a]:
                far[at] = far[at - 1]
                at -= 1
            far[at] = a
            num_far += 1
        if weight[b] <= 0.0:
            continue
        word = place[b] >> 6
        bit = np.uint64(1) << np.uint64(place[b] & 63)
        if reached[b] == 0.0:
            before[b] = -1
        for at in range(num_far):
            if reached[far[at]] <= reached[b]:
                break
            if not history[far[at], word] & bit:
                reached[b] = reached[far[at]]
                before[b] = far[at]
                break
        if before[b] >= 0:
            history[b] = history[before[b]]
        history[b, word] |= bit
        reached[b] += weight[b]
        if reached[b] > best:
            best, best_task = reached[b], b
        for c in range(near_from[b], far_from[b]):
            near = offset[b] + c - near_from[b]
            if not (bits[near >> 3] >> (near & 7)) & 1 or reached[b] <= reached[c]:
                continue
            if not history[b, place[c] >> 6] & (np.uint64(1) << np.uint64(place[c] & 63)):
                reached[c] = reached[b]
                before[c] = b
    return best, best_task


def _chain_to(task: int, before: Ints) -> list[int]:
    """Return the tasks of a chain in order of time (EXTRACTPATH of Alg. 3)."""
    chain = []
    while task >= 0:
        chain.append(task)
        task = int(before[task])
    return chain[::-1]

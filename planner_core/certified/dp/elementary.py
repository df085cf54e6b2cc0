r"""A bound on plans that forbids a path to image a target twice in one pass over it.

If an access offers several collects, the heaviest path of ``network`` takes a target again
and again while it is in view: each image is paid like the first. Here each path remembers the
targets that it has imaged and could image again before the next long pause, and passes through
another collect of such a target unpaid.

Each node keeps one label for all paths that lead to it: a value :math:`v` that no path exceeds,
and a set :math:`M` of targets. It dominates a path of value :math:`v_x` that has imaged
:math:`M_x` because, however both continue, the path gains at most
:math:`\sum_{M \setminus M_x} w` more than the label does: either that is no more than
:math:`v - v_x`, or :math:`M` is cut down to :math:`M \cap M_x`. So labels only ever forget, and
values only ever rise: the bound holds for any weights, and never exceeds that of plain paths.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.certified.signs import NOWHERE
from planner_core.certified.sizes import MEMORY_BITS
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.precedence.arcs import ArcNetwork, arc_network_of
from planner_core.problem import (
    COLLECT,
    Bools,
    Floats,
    Ints,
    Problem,
)
from planner_core.worth import surplus, weights

Words = npt.NDArray[np.uint64]


class Memory(NamedTuple):
    """What paths remember: a bit for each target in view, reused once it is out of view.

    A target is in view from its first collect to its last in one part of the network.

    Attributes
    ----------
    group
        Number of each node's pair of target and part, from 0 on. Shape ``(n,)``.
    bit
        Of each node's group; -1 if its target cannot be imaged twice, or no bit was left.
        Shape ``(n,)``.
    begins
        First node of each node's group. Shape ``(n,)``.
    low, high
        Bits of the groups in view at each node: the first 64, and the others. Shape ``(n,)``.
    start_bit
        Bits in the order in which groups take them.
    num_started
        How many of those are taken up to and at each node. Shape ``(n,)``.
    """

    group: Ints
    bit: Ints
    begins: Ints
    low: Words
    high: Words
    start_bit: Ints
    num_started: Ints


def memory_of(problem: Problem, network: ArcNetwork) -> Memory:
    """Return what paths through a network remember."""
    table, rows = problem.opportunities, network.row
    nodes = np.arange(len(rows))
    part = np.searchsorted(network.first, nodes, side="right")
    view = part * (len(problem.target_ids) + 1) + network.site
    _, first, group = np.unique(view, return_index=True, return_inverse=True)
    last = np.zeros(len(first), dtype=np.int64)
    np.maximum.at(last, group, nodes)
    is_twice = table.start_s[rows[last]] >= table.end_s[rows[first]] - 1e-3
    is_twice &= table.kind[rows[first]] == COLLECT
    return _memory(group.astype(np.int32), first.astype(np.int32), last.astype(np.int32), is_twice)


@kernel
def _memory(group: Ints, first: Ints, last: Ints, is_twice: Bools) -> Memory:
    n = len(group)
    bit_of = np.full(len(first), -1, dtype=np.int32)
    is_used = np.zeros(MEMORY_BITS, dtype=np.bool_)
    bit = np.full(n, -1, dtype=np.int32)
    begins = np.empty(n, dtype=np.int32)
    low, high = np.zeros(n, dtype=np.uint64), np.zeros(n, dtype=np.uint64)
    start_bit = np.empty(len(first), dtype=np.int32)
    num_started = np.empty(n, dtype=np.int32)
    count = 0
    low_now, high_now = np.uint64(0), np.uint64(0)
    for b in range(n):
        a = group[b]
        if first[a] == b and is_twice[a]:
            for k in range(MEMORY_BITS):
                if not is_used[k]:
                    is_used[k] = True
                    bit_of[a] = k
                    start_bit[count] = k
                    count += 1
                    if k < 64:
                        low_now |= np.uint64(1) << np.uint64(k)
                    else:
                        high_now |= np.uint64(1) << np.uint64(k - 64)
                    break
        k = bit_of[a]
        bit[b], begins[b] = k, first[a]
        low[b], high[b], num_started[b] = low_now, high_now, count
        if last[a] == b and k >= 0:
            is_used[k] = False
            if k < 64:
                low_now &= ~(np.uint64(1) << np.uint64(k))
            else:
                high_now &= ~(np.uint64(1) << np.uint64(k - 64))
    return Memory(group, bit, begins, low, high, start_bit[:count].copy(), num_started)


@bundle
class Labels(NamedTuple):
    """The labels of all nodes, and the origins of their values; shape ``(n,)``.

    Attributes
    ----------
    value, low, high
        Value, and the bits of the targets that are remembered.
    previous, is_paid
        The node that the value comes from (-1 for the start), and whether the node itself is paid.
    far_value, far_low, far_high, far_node
        The joint label of nodes that all may follow from here on. Shape ``(n + 1,)``.
    ceiling
        The greatest weight in each group.
    bit_weight
        The same for the group that holds each bit. Shape ``(128,)``.
    """

    value: Floats
    low: Words
    high: Words
    previous: Ints
    is_paid: Bools
    far_value: Floats
    far_low: Words
    far_high: Words
    far_node: Ints
    ceiling: Floats
    bit_weight: Floats


def labels_for(network: ArcNetwork, memory: Memory) -> Labels:
    """Return storage for the labels of a network."""
    n = len(network.row)
    return Labels(
        value=np.zeros(n),
        low=np.zeros(n, dtype=np.uint64),
        high=np.zeros(n, dtype=np.uint64),
        previous=np.full(n, -1, dtype=np.int32),
        is_paid=np.zeros(n, dtype=np.bool_),
        far_value=np.zeros(n + 1),
        far_low=np.zeros(n + 1, dtype=np.uint64),
        far_high=np.zeros(n + 1, dtype=np.uint64),
        far_node=np.full(n + 1, -1, dtype=np.int32),
        ceiling=np.zeros(int(memory.group.max(initial=-1)) + 1),
        bit_weight=np.zeros(MEMORY_BITS),
    )


@borrowing_inner
def label_part(
    network: ArcNetwork, memory: Memory, weight: Floats, labels: Labels, part: int
) -> tuple[float, int]:
    """Label the nodes of one part; return a bound on its paths' worth, and the node that has it.

    Parameters
    ----------
    weight
        Worth of each node, not negative. Shape ``(n,)``.
    """
    arc_from, before, far_from = network.arc_from, network.before, network.far_from
    group, bit, begins, open_low, open_high, start_bit, num_started = memory
    value, low, high = labels.value, labels.low, labels.high
    far_value, far_low, far_high = labels.far_value, labels.far_low, labels.far_high
    far_node, ceiling, bit_weight = labels.far_node, labels.ceiling, labels.bit_weight
    zero, one = np.uint64(0), np.uint64(1)
    begin, end = network.first[part], network.first[part + 1]
    for b in range(begin, end):
        ceiling[group[b]] = 0.0
        far_node[b] = NOWHERE
    for b in range(begin, end):
        ceiling[group[b]] = max(ceiling[group[b]], weight[b])
    # The joint label of all nodes far behind, including the start of the part.
    far, far_at, f_low, f_high = 0.0, -1, zero, zero
    best_end, best_at = 0.0, -1
    for b in range(begin, end):
        w, k, begins_at, wait = weight[b], bit[b], begins[b], network.earlier[b]
        own_low = one << np.uint64(k) if 0 <= k < 64 else zero
        own_high = one << np.uint64(k - 64) if k >= 64 else zero
        if k >= 0:
            bit_weight[k] = ceiling[group[b]]
        if begins_at == b:
            f_low &= ~own_low
            f_high &= ~own_high
        f_low &= open_low[b]
        f_high &= open_high[b]
        if far_node[b] != NOWHERE:
            far, far_at, f_low, f_high = _merged(
                far_value[b], far_node[b], far_low[b] & open_low[b], far_high[b] & open_high[b],
                far, far_at, f_low, f_high, bit_weight,
            )  # fmt: skip
        # The best value.
        paid = not ((f_low & own_low) | (f_high & own_high))
        best, at = far + (w if paid else 0.0), far_at
        far_reached, is_far = best, True
        if wait >= 0 and value[wait] >= best:
            best, at, paid, is_far = value[wait], wait, False, False
        for i in range(arc_from[b], arc_from[b + 1]):
            a = before[i]
            reached = value[a]
            if reached + w <= best:
                continue
            is_new = a < begins_at or not ((low[a] & own_low) | (high[a] & own_high))
            if is_new:
                reached += w
            if reached > best:
                best, at, paid, is_far = reached, a, is_new, False
        # Of what the best path remembers, keep what the label may claim for the other paths too.
        m_low, m_high = f_low, f_high
        if not is_far:
            new_low, new_high = _begun(start_bit, num_started[at], num_started[b])
            m_low = low[at] & open_low[b] & ~new_low
            m_high = high[at] & open_high[b] & ~new_high
            lost = _weight_of(m_low & ~f_low & ~own_low, m_high & ~f_high & ~own_high, bit_weight)
            if best - far_reached < lost:
                m_low &= f_low
                m_high &= f_high
        m_low &= ~own_low
        m_high &= ~own_high
        if m_low | m_high:
            whole = _weight_of(m_low, m_high, bit_weight)
            new_low, new_high = zero, zero  # bits of groups that began since
            q = num_started[b]
            i = arc_from[b + 1]
            while i >= arc_from[b] and (m_low | m_high):
                # The arc of waiting comes last.
                i -= 1
                is_wait = i < arc_from[b]
                a = wait if is_wait else before[i]
                if a < 0 or best - value[a] - w >= whole:
                    continue
                is_new = a < begins_at or not ((low[a] & own_low) | (high[a] & own_high))
                reached = value[a] + w if is_new and not is_wait else value[a]
                if best - reached >= whole:
                    continue
                if is_wait:
                    q, new_low, new_high = num_started[b], zero, zero
                if q > num_started[a]:
                    more_low, more_high = _begun(start_bit, num_started[a], q)
                    q, new_low, new_high = num_started[a], new_low | more_low, new_high | more_high
                left_low = m_low & (~low[a] | new_low)
                left_high = m_high & (~high[a] | new_high)
                if not (left_low | left_high):
                    continue
                if best - reached < _weight_of(left_low, left_high, bit_weight):
                    m_low &= ~left_low
                    m_high &= ~left_high
                    whole = _weight_of(m_low, m_high, bit_weight)
        value[b], labels.previous[b], labels.is_paid[b] = best, at, paid
        # A path that may gain more by another collect of the target must stay free to take it.
        if w >= ceiling[group[b]]:
            m_low |= own_low
            m_high |= own_high
        low[b], high[b] = m_low, m_high
        if best > best_end:
            best_end, best_at = best, b
        to = far_from[b]
        if to >= end:
            continue
        new_low, new_high = _begun(start_bit, num_started[b], num_started[to])
        _pass_on(labels, to, best, b, m_low & ~new_low, m_high & ~new_high)
    return best_end, best_at


@borrowing_inner
def _pass_on(
    labels: Labels, to: int, value: float, at: int, low: np.uint64, high: np.uint64
) -> None:
    """Let all nodes from ``to`` on follow a label."""
    if labels.far_node[to] != NOWHERE:
        value, at, low, high = _merged(
            value, at, low, high, labels.far_value[to], labels.far_node[to],
            labels.far_low[to], labels.far_high[to], labels.bit_weight,
        )  # fmt: skip
    labels.far_value[to], labels.far_node[to] = value, at
    labels.far_low[to], labels.far_high[to] = low, high


@borrowing_inner
def _merged(
    value: float, at: int, low: np.uint64, high: np.uint64,
    other: float, other_at: int, other_low: np.uint64, other_high: np.uint64, bit_weight: Floats,
) -> tuple[float, int, np.uint64, np.uint64]:  # fmt: skip
    """Return the better of two labels, the second if equal, cut down so that it covers both."""
    if value <= other:
        value, at, low, high, other, other_low, other_high = (
            other, other_at, other_low, other_high, value, low, high,
        )  # fmt: skip
    if value - other < _weight_of(low & ~other_low, high & ~other_high, bit_weight):
        low &= other_low
        high &= other_high
    return value, at, low, high


@borrowing_inner
def _begun(start_bit: Ints, first: int, last: int) -> tuple[np.uint64, np.uint64]:
    """Return the bits ``start_bit[first:last]`` of groups that began one after another."""
    low, high = np.uint64(0), np.uint64(0)
    for q in range(first, last):
        started = start_bit[q]
        if started < 64:
            low |= np.uint64(1) << np.uint64(started)
        else:
            high |= np.uint64(1) << np.uint64(started - 64)
    return low, high


@borrowing_inner
def _weight_of(low: np.uint64, high: np.uint64, bit_weight: Floats) -> float:
    """Return the weight of a set of targets."""
    total = 0.0
    one = np.uint64(1)
    for half in range(2):
        left = high if half else low
        k = 64 * half
        while left:
            if not left & np.uint64(0xFFFF):
                left >>= np.uint64(16)
                k += 16
                continue
            if not left & np.uint64(0xF):
                left >>= np.uint64(4)
                k += 4
                continue
            if left & one:
                total += bit_weight[k]
            left >>= one
            k += 1
    return total


@borrowing
def elementary_paths(
    network: ArcNetwork, memory: Memory, weight: Floats, labels: Labels, counts: Ints
) -> float:
    """Return a bound on what the paths of all parts are worth together.

    Parameters
    ----------
    counts
        Filled with how often the best paths are paid for each target; shape
        ``(num_targets + 1,)``.
    """
    for place in range(len(counts)):
        counts[place] = 0
    total = 0.0
    for part in range(len(network.first) - 1):
        value, at = label_part(network, memory, weight, labels, part)
        total += value
        while at >= 0:
            if labels.is_paid[at]:
                counts[network.site[at]] += 1
            at = labels.previous[at]
    return total


def elementary_value(problem: Problem, multipliers: Floats) -> tuple[float, Ints]:
    """Return the bound that target multipliers prove, and how often paths are paid for each target.

    This is the whole proof, as ``lagrangian_value`` is that of the plain bound.
    """
    network = arc_network_of(problem)
    memory = memory_of(problem, network)
    multiplier = np.append(surplus(multipliers, problem.best_worth), 0.0)
    weight = weights(problem.worth[network.row], multiplier[network.site])
    counts = np.zeros(len(multiplier), dtype=np.int32)
    total = elementary_paths(network, memory, weight, labels_for(network, memory), counts)
    return float(multiplier.sum() + total), counts[:-1]

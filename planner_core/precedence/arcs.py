"""Precedence as lists of arcs, for oracles that visit each pair many times.

The number of arcs grows with the square of the number of targets in view; plain longest paths
need none of them (see ``planner_core.precedence.skyline``).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.jit import borrowing_inner, kernel
from planner_core.precedence.network import part_ends
from planner_core.precedence.relation import (
    Precedence,
    comes_before,
    direct_precedence,
    is_transitive_on,
)
from planner_core.problem import COLLECT, Ints, Longs, Problem

Words = npt.NDArray[np.uint64]

_WORD: Final = 64


class Arcs(NamedTuple):
    """Arcs from each task: ``to[first[a] : first[a + 1]]``.

    Attributes
    ----------
    first
        Shape ``(m + 1,)``.
    to
        Rows in ascending order for each task. Shape ``(num_arcs,)``.
    """

    first: Longs
    to: Ints


def covering_arcs(precedence: Precedence, later: Ints | None = None) -> Arcs:
    """Return the pairs of tasks that may follow each other with none in between.

    ``precedence`` must be transitive: a chain of these arcs then leads from each task to every
    task that may follow it. There are about ten for each task, far fewer than pairs; some fifty
    if an access offers a collect every 15 s.

    Parameters
    ----------
    later
        For each task another one whose followers may all follow it too, or -1 (see
        ``waiting``): arcs to the followers of that one are left out. Shape ``(m,)``.
    """
    m = len(precedence.near_from)
    return _covering(precedence, np.full(m, -1, dtype=np.int32) if later is None else later)


@borrowing_inner
def _bits_at(words: Words, bit: int) -> np.uint64:
    """Return the 64 bits that begin with a given one."""
    at, into = bit >> 6, np.uint64(bit & 63)
    found: np.uint64 = words[at] >> into
    if into > 0:
        found |= words[at + 1] << (np.uint64(_WORD) - into)
    return found


@borrowing_inner
def _add_followers(
    near_from: Ints, offset: Longs, words: Words, c: int, begin: int, end: int, covered: Words
) -> None:
    """Mark in ``covered``, whose first bit stands for row ``begin``, the near followers of c.

    Only rows below ``end`` count; ``end`` is at most the first far follower.
    """
    low = near_from[c] - begin
    for k in range(max(low, 0) >> 6, (end - begin + _WORD - 1) >> 6):
        shift = low - _WORD * k
        if shift > 0:
            covered[k] |= _bits_at(words, offset[c]) << np.uint64(shift)
        else:
            covered[k] |= _bits_at(words, offset[c] - shift)


@kernel
def _covering(precedence: Precedence, later: Ints) -> Arcs:
    near_from, far_from, offset, bits = precedence
    words = bits.view(np.uint64)
    m = len(near_from)
    first = np.zeros(m + 1, dtype=np.int64)
    to = np.empty(16 * m + 16, dtype=np.int32)
    covered = np.zeros(64, dtype=np.uint64)
    count = 0
    for a in range(m):
        begin = near_from[a]
        # An arc covers all rows that even the longest slew from its end reaches.
        end = m
        marked = 0  # words of ``covered`` that are in use
        if later[a] >= 0:
            end = far_from[later[a]]
            marked = ((end - begin) >> 6) + 1
            if marked > len(covered):
                covered = np.zeros(2 * marked, dtype=np.uint64)
            covered[:marked] = 0
            _add_followers(near_from, offset, words, later[a], begin, end, covered)
        b = begin
        while b < end:
            if b < far_from[a]:
                left = _bits_at(words, offset[a] + b - begin)
                if b + _WORD > far_from[a]:
                    left &= (np.uint64(1) << np.uint64(far_from[a] - b)) - np.uint64(1)
                    left |= ~np.uint64(0) << np.uint64(far_from[a] - b)
            else:
                left = ~np.uint64(0)
            if marked:
                left &= ~covered[(b - begin) >> 6]
            while left:
                lowest = left & (~left + np.uint64(1))
                left ^= lowest
                c = b + _trailing_zeros(lowest)
                if c >= end:
                    break
                if count == len(to):
                    to = np.concatenate((to, np.empty_like(to)))
                to[count] = c
                count += 1
                if marked == 0:
                    marked = ((far_from[c] - begin) >> 6) + 1
                    if marked > len(covered):
                        covered = np.zeros(2 * marked, dtype=np.uint64)
                    covered[:marked] = 0
                end = min(end, far_from[c])
                _add_followers(near_from, offset, words, c, begin, end, covered)
                left &= ~covered[(b - begin) >> 6]
            b += _WORD
        first[a + 1] = count
    return Arcs(first, to[:count].copy())


@borrowing_inner
def _trailing_zeros(lowest: np.uint64) -> int:
    """Return the position of a word's only set bit."""
    at = 0
    for step in (32, 16, 8, 4, 2, 1):
        if lowest >> np.uint64(step + at):
            at += step
    return at


@kernel
def waiting(precedence: Precedence, access: Ints) -> Ints:
    """Return for each task the next collect of its access if waiting for it loses nothing, or -1.

    Waiting loses nothing if whatever may follow the later collect may follow the earlier one too.
    A longest path then reaches the followers of the later one by waiting.

    Parameters
    ----------
    access
        Number of the access that each task lies in. Shape ``(m,)``.
    """
    near_from, far_from, offset, bits = precedence
    words = bits.view(np.uint64)
    m = len(access)
    later = np.full(m, -1, dtype=np.int32)
    last = np.full(access.max() + 1 if m else 0, -1, dtype=np.int32)
    for b in range(m):
        a = last[access[b]]
        last[access[b]] = b
        if a < 0 or near_from[a] > near_from[b] or far_from[a] > far_from[b]:
            continue
        is_subset = True
        row = near_from[b]
        while is_subset and row < far_from[a]:
            needed = _bits_at(words, offset[b] + row - near_from[b])
            given = _bits_at(words, offset[a] + row - near_from[a])
            if row + _WORD > far_from[a]:
                needed &= (np.uint64(1) << np.uint64(far_from[a] - row)) - np.uint64(1)
            is_subset = not needed & ~given
            row += _WORD
        if is_subset:
            later[a] = b
    return later


@kernel
def near_arcs(precedence: Precedence) -> Arcs:
    """Return arcs for all near pairs that may follow each other."""
    m = len(precedence.near_from)
    first = np.zeros(m + 1, dtype=np.int64)
    for a in range(m):
        first[a + 1] = first[a]
        for b in range(precedence.near_from[a], precedence.far_from[a]):
            first[a + 1] += comes_before(precedence, a, b)
    to = np.empty(first[m], dtype=np.int32)
    count = 0
    for a in range(m):
        for b in range(precedence.near_from[a], precedence.far_from[a]):
            if comes_before(precedence, a, b):
                to[count] = b
                count += 1
    return Arcs(first, to)


@kernel
def reversed_arcs(arcs: Arcs) -> Arcs:
    """Return the same arcs, listed from their ends to their origins."""
    m = len(arcs.first) - 1
    first = np.zeros(m + 1, dtype=np.int64)
    for b in arcs.to:
        first[b + 1] += 1
    for b in range(m):
        first[b + 1] += first[b]
    filled = first[:m].copy()
    come_from = np.empty(len(arcs.to), dtype=np.int32)
    for a in range(m):
        for at in range(arcs.first[a], arcs.first[a + 1]):
            b = arcs.to[at]
            come_from[filled[b]] = a
            filled[b] += 1
    return Arcs(first, come_from)


@bundle
class ArcNetwork(NamedTuple):
    """The nodes of ``Network`` with stored arcs, for labels that look at each pair many times.

    A path is a sequence of tasks of one satellite that may follow each other directly. It may
    pass through a task without being paid, so if that relation is transitive only covering arcs
    are kept (those that no third task can split). If an access offers several collects, what may
    follow a later one may follow an earlier one too: the path then waits, and arcs from the
    earlier one to the followers of the later one are left out.

    Attributes
    ----------
    row
        Row of each node in the table of opportunities. Shape ``(n,)``.
    site
        Target of each node; of a contact, one past the last target. Shape ``(n,)``.
    first
        First node of each part. A pause longer than any slew divides a satellite's tasks into
        parts: paths before and after it are independent. Shape ``(num_parts + 1,)``.
    arc_from, before
        Predecessors of node ``b``: ``before[arc_from[b]:arc_from[b + 1]]``.
    far_from
        The first node from which all of the satellite may follow the node; at most the end of
        its part. Shape ``(n,)``.
    earlier
        The previous collect in the same access, from which a path may wait for the followers of
        the node; -1 for none. Shape ``(n,)``.
    """

    row: Ints
    site: Ints
    first: Longs
    arc_from: Longs
    before: Ints
    far_from: Ints
    earlier: Ints


def arc_network_of(problem: Problem) -> ArcNetwork:
    """Return the arcs of a problem."""
    table = problem.opportunities
    nothing = np.empty(0, dtype=np.int32)
    row, before, far_from, earlier = [nothing], [nothing], [nothing], [nothing]
    first, arc_from = [np.zeros(1, dtype=np.int64)], [np.zeros(1, dtype=np.int64)]
    base = num_arcs = 0
    for satellite in problem.satellites:
        direct = direct_precedence(satellite)
        later = waiting(direct, table.access[satellite.rows])
        arcs = covering_arcs(direct, later) if is_transitive_on(satellite) else near_arcs(direct)
        ends = part_ends(satellite.transitions)
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
        far_from.append(direct.far_from + np.int32(base))
        earlier.append(own)
        base += len(satellite)
        num_arcs += len(rows)
    rows = np.concatenate(row)
    is_collect = table.kind[rows] == COLLECT
    return ArcNetwork(
        row=rows,
        site=np.where(is_collect, table.site[rows], len(problem.target_ids)).astype(np.int32),
        first=np.concatenate(first),
        arc_from=np.concatenate(arc_from),
        before=np.concatenate(before),
        far_from=np.concatenate(far_from),
        earlier=np.concatenate(earlier),
    )


def _within(arcs: Arcs, part: Longs) -> Arcs:
    """Return the arcs that stay within one part."""
    is_within = np.repeat(part, np.diff(arcs.first)) == part[arcs.to]
    count = np.concatenate([[0], np.cumsum(is_within)])
    return Arcs(count[arcs.first].astype(np.int64), arcs.to[is_within])

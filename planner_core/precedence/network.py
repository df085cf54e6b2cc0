"""All satellites' tasks in parts, and the heaviest paths through them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.jit import borrowing_inner, inner, kernel
from planner_core.precedence.relation import turns_slower_than_it_tracks
from planner_core.precedence.skyline import (
    Skyline,
    best_ahead,
    clear,
    enter,
    skyline_for,
    value_of,
)
from planner_core.problem import (
    COLLECT,
    Bools,
    Floats,
    Ints,
    Longs,
    Problem,
    SatelliteProblem,
    Transitions,
)
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import Slews


@bundle
class Network(NamedTuple):
    """The tasks of all satellites, one satellite after another, each in order of start.

    A path is a sequence of tasks of one satellite that may follow each other directly. A pause
    longer than any slew divides a satellite's tasks into parts: paths before and after it are
    independent.

    Attributes
    ----------
    row
        Row of each node in the table of opportunities. Shape ``(n,)``.
    site
        Target of each node; of a contact, one past the last target. Shape ``(n,)``.
    first
        First node of each part. Shape ``(num_parts + 1,)``.
    start_s, end_s, looks, looked
        As in ``Transitions``. Shape ``(n,)``, ``(n, 3)``.
    by_end
        Each part's nodes in order of end. Shape ``(n,)``.
    is_turning
        Whether a task turns its satellite further than a slew of its length would, so that a path
        may gain from it whatever it is worth itself. Shape ``(n,)``.
    satellite
        Of each part, as a row of ``agility``. Shape ``(num_parts,)``.
    agility
        Rate, acceleration, settling, longest slew, entries of the table of slews for each second.
        Shape ``(num_satellites, 5)``.
    least_cosine
        The tables of slews, one satellite's after another.
    """

    row: Ints
    site: Ints
    first: Longs
    start_s: Floats
    end_s: Floats
    looks: Floats
    looked: Floats
    by_end: Ints
    is_turning: Bools
    satellite: Ints
    agility: Floats
    least_cosine: Floats


def network_of(problem: Problem, satellites: Sequence[SatelliteProblem] | None = None) -> Network:
    """Return the network of a problem, or of some of its satellites."""
    satellites = problem.satellites if satellites is None else satellites
    tasks = [satellite.transitions for satellite in satellites]
    bases = np.cumsum([0, *(len(satellite) for satellite in satellites)])[:-1]
    ends = [part_ends(transitions) for transitions in tasks]
    # Among tasks that end together those of zero length come last: they may follow the others.
    by_end = [np.lexsort((t.start_s, t.end_s)) for t in tasks]
    rows = _joined([satellite.rows for satellite in satellites], np.int32)
    is_collect = problem.opportunities.kind[rows] == COLLECT
    site = np.where(is_collect, problem.opportunities.site[rows], len(problem.target_ids))
    return Network(
        row=rows,
        site=site.astype(np.int32),
        first=_joined([0, *(b + e for b, e in zip(bases, ends, strict=True))], np.int64),
        start_s=_joined([t.start_s for t in tasks], np.float64),
        end_s=_joined([t.end_s for t in tasks], np.float64),
        looks=_joined([t.looks for t in tasks], np.float64).reshape(-1, 3),
        looked=_joined([t.looked for t in tasks], np.float64).reshape(-1, 3),
        by_end=_joined([b + o for b, o in zip(bases, by_end, strict=True)], np.int32),
        is_turning=_joined([turns_slower_than_it_tracks(t) for t in tasks], np.bool_),
        satellite=np.repeat(np.arange(len(tasks)), [len(e) for e in ends]).astype(np.int32),
        agility=_joined([t.slews[:5] for t in tasks], np.float64).reshape(-1, 5),
        least_cosine=_joined([t.slews.least_cosine for t in tasks], np.float64),
    )


def _joined(parts: Sequence[npt.ArrayLike], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Return the arrays flattened and joined; an empty one if there are none."""
    flat = [np.ravel(part) for part in parts]
    return np.concatenate([np.empty(0, dtype=dtype), *flat]).astype(dtype)


def part_ends(transitions: Transitions) -> Longs:
    """Return the ends of a satellite's parts; every later task may follow every task of a part."""
    slews = transitions.slews
    free_s = np.maximum.accumulate(transitions.end_s) + (slews.longest_s + slews.settle_s)
    ends = np.arange(1, len(free_s) + 1, dtype=np.int64)
    return ends[np.append(transitions.start_s[1:], np.inf)[: len(ends)] >= free_s]


@borrowing_inner
def slews_in(network: Network, part: int) -> Slews:
    """Return the slews of a part's satellite; only for kernels that borrow, as this one does."""
    of = network.satellite[part]
    num_entries = len(network.least_cosine) // len(network.agility)
    rate, acceleration, settle, longest, per_s = (
        network.agility[of, 0], network.agility[of, 1], network.agility[of, 2],
        network.agility[of, 3], network.agility[of, 4],
    )  # fmt: skip
    return Slews(rate, acceleration, settle, longest, per_s, network.least_cosine, of * num_entries)


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
        node before it on that path, or -1. Nodes of no worth are on no path, except those by
        which a slow satellite turns. Shape ``(n,)``.
    ends
        Filled with the last node of each part's path, or -1. Shape ``(num_parts,)``.
    """
    total = 0.0
    for part in range(len(network.first) - 1):
        worth, ends[part] = heaviest_path(network, part, weight, value, previous)
        total += worth
    return total


@inner
def heaviest_path(
    network: Network, part: int, weight: Floats, value: Floats, previous: Ints
) -> tuple[float, int]:
    """Return the weight of one part's heaviest path, and its last node or -1.

    The arrays are those of ``heaviest_paths``; only the part's own nodes are used.
    """
    sky = skyline_for(network.first[part + 1] - network.first[part])
    return _scan(network, part, weight, value, previous, sky, False, False)


@borrowing_inner
def _scan(
    network: Network, part: int, weight: Floats, value: Floats, previous: Ints, sky: Skyline,
    is_backward: bool, is_every: bool,
) -> tuple[float, int]:  # fmt: skip
    """Fill in the heaviest paths that end with each node; backward, those that begin with it.

    Backward, time is negated: a task begins at its end and ends at its start. With ``is_every``
    nodes of no worth are filled in too.
    """
    begin, end = network.first[part], network.first[part + 1]
    slews = slews_in(network, part)
    by_end, is_turning = network.by_end, network.is_turning
    starts_s, ends_s, sign = network.start_s, network.end_s, 1.0
    looks, looked = network.looks, network.looked
    if is_backward:
        starts_s, ends_s, sign = network.end_s, network.start_s, -1.0
        looks, looked = network.looked, network.looks
    clear(sky)
    count, entered = 0, 0
    best, best_at = 0.0, -1
    for i in range(end - begin):
        b = by_end[end - 1 - i] if is_backward else begin + i
        previous[b] = -1
        value[b] = 0.0
        if weight[b] <= 0.0 and not is_turning[b] and not is_every:
            continue
        start_s = sign * starts_s[b]
        limit_s = start_s - slews.settle_s + TIME_TOLERANCE_S
        while entered < end - begin:
            c = end - 1 - entered if is_backward else by_end[begin + entered]
            # Among tasks of zero length at one instant none comes before one with a lower row.
            is_next = c <= b if is_backward else c >= b
            if is_next or sign * ends_s[c] > limit_s:
                break
            entered += 1
            if value[c] > 0.0 and (weight[c] > 0.0 or is_turning[c]):
                count = enter(
                    sky, count, value[c], sign * ends_s[c],
                    (looked[c, 0], looked[c, 1], looked[c, 2]), c, slews,
                )  # fmt: skip
        at = best_ahead(sky, start_s, (looks[b, 0], looks[b, 1], looks[b, 2]), slews)
        value[b] = value_of(sky, at) + weight[b]
        if at >= 0:
            previous[b] = sky.node[at]
        if value[b] > best:
            best, best_at = value[b], b
    return best, best_at


@kernel
def heaviest_through(network: Network, weight: Floats) -> tuple[float, Floats]:
    """Return the sum of the heaviest paths, and for each node the sum if a path must hold it."""
    n = len(weight)
    through, onward = np.empty(n), np.empty(n)
    previous = np.empty(n, dtype=np.int32)
    num_parts = len(network.first) - 1
    own = np.empty(num_parts)
    total = 0.0
    for part in range(num_parts):
        sky = skyline_for(network.first[part + 1] - network.first[part])
        own[part], _ = _scan(network, part, weight, through, previous, sky, False, True)
        _scan(network, part, weight, onward, previous, sky, True, True)
        total += own[part]
    for part in range(num_parts):
        others = total - own[part]
        for a in range(network.first[part], network.first[part + 1]):
            through[a] += others + onward[a] - weight[a]
    return total, through

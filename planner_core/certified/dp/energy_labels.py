"""The most that one satellite can gain under its battery alone: worth exact, energy in levels.

``most_value`` counts worth in whole units and knows energy exactly; here it is the other way
round, and the recorder is left out. That takes a fraction of the time, so that hundreds of
multipliers can be tried. For a proof energy is rounded in favour of the satellite, so that no plan
is lost; a search for multipliers needs only an estimate.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.sizes import MAX_ENERGY_LEVELS
from planner_core.certified.tolerances import LEVEL
from planner_core.jit import inlined, inner, kernel, templated
from planner_core.problem import Bools, Floats, Ints, Longs

Rounding = Literal["optimistic", "pessimistic", "nearest"]
"""In this order: no plan is lost, every path keeps its limits, neither is guaranteed."""


@bundle
class EnergyLevels(NamedTuple):
    """The energy columns of a ``Network`` in levels; shape ``(m,)``.

    Attributes
    ----------
    lowest
        The least of ``floor`` and ``cap - cost`` of all rows up to each one.
    width
        How many levels there are from ``lowest`` up that a path can be at.
    give
        What the network's arcs to each row give back, in the order of ``straight_rows``.
        Shape ``(num_arcs,)``.
    """

    cap: Ints
    cost: Ints
    floor: Ints
    lowest: Ints
    start: int
    width: int
    give: Ints


def energy_levels(
    network: Network,
    per_collect: int,
    rounding: Rounding = "optimistic",
    exact: Bools | None = None,
) -> EnergyLevels:
    """Return levels of which the cheapest collect costs ``per_collect``; coarser ones if too many.

    Parameters
    ----------
    exact
        Tasks whose own costs are not rounded; if every path must keep its limits, only tasks that
        every path takes. Each one's cost is raised to whole levels, and limits from there on are
        lowered by as much: paths that take it gain nothing by rounding, and others are given that
        little. Shape ``(m,)``.
    """
    collects = network.energy_cost[~network.is_contact.astype(np.bool_)]
    positive = collects[collects > 0.0]
    step = float(positive.min()) / per_collect if len(positive) else 1.0
    left = np.minimum(network.energy_floor, network.energy_cap - network.energy_cost)
    span = float((network.energy_cap - np.minimum.accumulate(left)).max(initial=0.0))
    step = max(step, span / MAX_ENERGY_LEVELS)
    down, up = _ROUNDED[rounding]
    if _gives(network) and rounding != "pessimistic":
        cap, cost, floor, give = _rounded_potentials(network, step, down, up)
    else:
        short = np.zeros(len(network.energy_cost))
        if exact is not None:
            short[exact] = step * _up(network.energy_cost[exact], step) - network.energy_cost[exact]
        lower = np.cumsum(short)
        # If every path must keep its limits, what arcs give back is left out.
        cap = up(network.energy_cap - lower + short, step)
        cost = down(network.energy_cost + short, step)
        floor = down(network.energy_floor - lower, step)
        give = np.zeros(len(network.straight_give), dtype=np.int32)
    lowest = np.minimum.accumulate(np.minimum(floor, cap - cost)).astype(np.int32)
    return EnergyLevels(
        cap=cap,
        cost=cost,
        floor=floor,
        lowest=lowest,
        start=int(up(np.array(network.energy_start), step)),
        width=int((cap - np.minimum(cost, 0) - lowest).max(initial=0)) + 1,
        give=give,
    )


def levels_of_proof(network: Network, per_collect: int, exact: Bools | None = None) -> EnergyLevels:
    """Return levels that lose no plan: with turns to the sun, as many as tables may have.

    No two costs are alike with such turns, and roundings add up: on the paper's satellite with a
    half-life, 24 levels to an image proved 203.2, and 192 of them 193.6.
    """
    levels = MAX_ENERGY_LEVELS if _gives(network) else per_collect
    return energy_levels(network, levels, exact=exact)


def levels_of_estimate(network: Network, per_collect: int) -> EnergyLevels:
    """Return levels for the search for multipliers; with turns to the sun they may lose plans.

    Rounding in favour of the satellite yields multipliers that suit a stronger satellite. Those
    from half as many levels, rounded to the nearest, prove bounds that are 0.4 % lower in half the
    time (docs/bounds.md).
    """
    if _gives(network):
        return energy_levels(network, per_collect // 2, "nearest")
    return energy_levels(network, per_collect)


def _gives(network: Network) -> bool:
    return bool(network.straight_give.any())


def _up(energy: Floats, step: float) -> Ints:
    return np.ceil(energy / step - LEVEL).astype(np.int32)


def _down(energy: Floats, step: float) -> Ints:
    return np.floor(energy / step + LEVEL).astype(np.int32)


def _nearest(energy: Floats, step: float) -> Ints:
    return np.rint(energy / step).astype(np.int32)


_Round = Callable[[Floats, float], Ints]
# How to round what counts against the satellite, and what counts for it.
_ROUNDED: dict[Rounding, tuple[_Round, _Round]] = {
    "optimistic": (_down, _up),
    "pessimistic": (_up, _down),
    "nearest": (_nearest, _nearest),
}


def _rounded_potentials(
    network: Network, step: float, down: _Round, up: _Round
) -> tuple[Ints, Ints, Ints, Ints]:
    """Return cap, cost and floor by task, and what arcs give back, from potentials in levels.

    With turns to the sun no two costs are alike, and rounding each in favour of the satellite
    would lose up to a level with every task and every arc. If the accumulated idle energy is
    rounded instead, the errors along a path cancel.
    """
    before, after = down(network.energy_from, step), up(network.energy_to, step)
    draw = down(network.energy_cost - network.energy_from + network.energy_to, step)
    full = up(network.energy_cap + network.energy_to, step)
    least = down(network.energy_floor + network.energy_from, step)
    k = np.repeat(np.arange(len(draw)), np.diff(network.straight_first))
    i = network.straight_rows
    change = network.energy_to[k] - network.energy_from[i] + network.straight_give
    give = np.where(network.straight_give > 0.0, up(change, step) - after[k] + before[i], 0)
    cost = draw + before - after
    return full - after, cost, least - before, np.maximum(give, 0).astype(np.int32)


@kernel
def most_by_energy(
    network: Network, levels: EnergyLevels, weight: Floats, own: Floats, num_own: Longs
) -> tuple[float, Ints]:
    """Return the most that a path gains, and the rows of such a path.

    Parameters
    ----------
    weight
        Worth of each task; tasks that are worth nothing are not taken. Shape ``(m,)``.
    own, num_own
        Workspace, of shapes ``(m, width)`` and ``(m,)`` at least. Filled with the most gained by a
        path that ends with each row and leaves at least a certain energy, counted from ``lowest``,
        and with how many such entries there are.
    """
    m = len(weight)
    idle = np.full(levels.width, -np.inf)
    base = levels.lowest[0] if m else 0
    idle[: max(0, levels.start - base + 1)] = 0.0
    merged, best, last = 0, 0.0, -1
    for k in range(m):
        sink(idle, base - levels.lowest[k])
        base = levels.lowest[k]
        merged = merge_ended(network, levels, k, merged, idle, own, num_own)
        num_own[k] = 0
        if weight[k] > 0.0:
            num_own[k] = extended(network, levels, k, weight[k], idle, own, num_own)
        if num_own[k] > 0 and own[k, 0] > best:
            best, last = own[k, 0], k
    return best, _path_to(network, levels, weight, own, num_own, last)


@inner
def merge_ended(
    network: Network,
    levels: EnergyLevels,
    k: int,
    merged: int,
    idle: Floats,
    own: Floats,
    num_own: Longs,
) -> int:
    """Add to ``idle`` the paths that all rows from ``k`` on may follow; return the rows merged.

    ``idle`` begins with the lowest level of row ``k``.
    """
    m = len(network.by_idle)
    while merged < m and network.idle_from[network.by_idle[merged]] <= k:
        i = network.by_idle[merged]
        raise_to(idle, own[i, : num_own[i]], levels.lowest[i] - levels.lowest[k])
        merged += 1
    return merged


@inner
def extended(
    network: Network,
    levels: EnergyLevels,
    k: int,
    weight: float,
    idle: Floats,
    own: Floats,
    num_own: Longs,
) -> int:
    """Extend all paths by row ``k``; return how many entries its table has.

    ``idle`` begins with the lowest level of row ``k``.
    """
    base = levels.lowest[k]
    low = max(0, levels.floor[k] - base)
    high = levels.cap[k] - levels.cost[k] - base + 1
    if high <= low:
        return 0
    values = own[k, :high]
    values[:] = -np.inf
    raise_to(values[low:], idle, -low - levels.cost[k])
    for at in range(network.straight_first[k], network.straight_first[k + 1]):
        i = network.straight_rows[at]
        up = levels.lowest[i] + levels.give[at] - base - levels.cost[k]
        raise_to(values[low:], own[i, : num_own[i]], up - low)
    values[:low] = values[low]
    while high > 0 and values[high - 1] == -np.inf:
        high -= 1
    for x in range(high):
        values[x] += weight
    return int(high)


@templated
def sink(idle: Floats | Ints, levels: int) -> None:
    """Lower the lowest level by ``levels``: an entry for more energy holds for less as well."""
    if levels > 0:
        width = len(idle)
        lowest = idle[0]
        for x in range(width - 1, levels - 1, -1):
            idle[x] = idle[x - levels]
        for x in range(min(levels, width)):
            idle[x] = lowest


@templated
def raise_to(values: Floats | Ints, others: Floats | Ints, up: int) -> None:
    """Raise values to a table's that begins ``up`` levels higher; lower if it is negative."""
    if len(others) == 0:
        return
    first = others[0]
    for x in range(min(up, len(values))):
        values[x] = max(values[x], first)
    begin, skipped = max(up, 0), max(-up, 0)
    count = min(len(values) - begin, len(others) - skipped)
    for x in range(count):
        values[begin + x] = max(values[begin + x], others[skipped + x])


@inner
def _path_to(
    network: Network, levels: EnergyLevels, weight: Floats, own: Floats, num_own: Longs, last: int
) -> Ints:
    """Return the rows of a best path that ends with row ``last``, worked out backward."""
    rows = np.empty(len(weight), dtype=np.int32)
    length = 0
    k, energy = last, levels.lowest[last] if last >= 0 else 0
    while k >= 0:
        rows[length] = k
        length += 1
        energy = max(energy, levels.floor[k])
        gained = own[k, energy - levels.lowest[k]]
        energy += levels.cost[k]
        before = k - 1
        while before >= 0:
            give = given_between(network, levels, before, k)
            x = max(0, energy - max(give, 0) - levels.lowest[before])
            if give >= 0 and x < num_own[before] and own[before, x] + weight[k] == gained:
                energy -= give
                break
            before -= 1
        k = before
    return rows[:length][::-1].copy()


@inlined
def given_between(network: Network, levels: EnergyLevels, i: int, k: int) -> int:
    """Return the levels that the way from row ``i`` to ``k`` gives back; -1 if there is no way."""
    if k >= network.idle_from[i]:
        return 0
    for at in range(network.straight_first[k], network.straight_first[k + 1]):
        if network.straight_rows[at] == i:
            return int(levels.give[at])
    return -1

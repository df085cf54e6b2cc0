r"""One satellite's tasks as a network on which plans under battery and recorder are paths.

What idle time adds up to is subtracted from levels: energy :math:`E = p - C(t)` with the charge
:math:`C` of all sunlit seconds so far, data :math:`G = d - b\,t` with the telemetry rate
:math:`b`. Idling is then free, and both dynamics of ``mdp.resource_columns`` become one step:
task ``j`` may be taken from :math:`(E, G)` if :math:`G \le` ``data_before[j]``, and leaves

* :math:`E' = \min(E,` ``energy_cap[j]`` :math:`) -` ``energy_cost[j]`` :math:`\ge`
  ``energy_floor[j]``,
* :math:`G' = \max(` ``data_floor[j]`` :math:`, G +` ``data_gain[j]`` :math:`) \le`
  ``data_after[j]``.

After ``i`` the satellite goes straight on to one of its near followers, or it idles: from row
``idle_from[i]`` on every task may follow, so that it no longer matters which task was the last.

If pointing at the sun needs turns, :math:`C` is taken when the sun is reached after ``i`` and when
it is left for ``j``. If that leaves no time at the sun the difference is negative, which would take
charge away: such arcs give it back, :math:`E' = \min(E +` ``give`` :math:`, ...)`, and none of
them leads to row ``idle_from[i]`` or a later one.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.signs import ANY_LEVEL
from planner_core.certified.tolerances import ROUNDING
from planner_core.jit import inlined, kernel
from planner_core.mdp.resource_columns import STRICT, resource_columns
from planner_core.precedence.arcs import Arcs, reversed_arcs
from planner_core.precedence.relation import (
    Precedence,
    comes_before,
    direct_precedence,
    is_transitive_on,
)
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Ints,
    Longs,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.delivery import lost_on_board
from planner_core.problem.slew import TIME_TOLERANCE_S


@bundle
class Network(NamedTuple):
    """Tasks and arcs of one satellite, limits off by a hair; shape ``(m,)`` unless said otherwise.

    ``near_rows[near_first[i] : near_first[i + 1]]`` are the rows below ``idle_from[i]`` that
    may follow ``i``, ``near_give`` what these arcs give back; ``straight_*`` list the same arcs by
    the later row. ``by_idle`` lists all rows in order of ``idle_from``. Every path must take the
    rows with ``is_kept``. ``energy_from`` and ``energy_to`` are what idle time adds up to when it
    begins after a task, and when it ends at one.

    If images count on the ground alone, some best plan takes none that stays on board: without it
    no other comes down later. With row ``i`` as the last image, data may end at ``delivered[i]`` at
    most, which is telemetry younger than that image. ``must_deliver`` says that this applies, which
    needs that dropping an image makes no turn impossible. If images on board earn a share, data on
    board at the end costs ``left_cost``, the worth that a full recorder loses.
    """

    site: Ints
    is_contact: np.ndarray
    is_kept: np.ndarray
    idle_from: Ints
    by_idle: Ints
    near_first: Longs
    near_rows: Ints
    near_give: Floats
    straight_first: Longs
    straight_rows: Ints
    straight_give: Floats
    energy_from: Floats
    energy_to: Floats
    energy_cap: Floats
    energy_cost: Floats
    energy_floor: Floats
    data_gain: Floats
    data_floor: Floats
    data_before: Floats
    data_after: Floats
    delivered: Floats
    energy_start: float
    data_start: float
    data_end: float
    must_deliver: bool
    left_cost: float


# Horizon and stations are the same in all problems of a satellite; these three are not.
_Kind: TypeAlias = tuple[bool, str, float]
_made: WeakKeyDictionary[SatelliteProblem, dict[_Kind, Network]] = WeakKeyDictionary()


def network_of(problem: Problem, satellite: SatelliteProblem) -> Network:
    """Return the network whose paths include every plan that the referee accepts."""
    return _network(problem, satellite, ROUNDING)


def strict_network_of(problem: Problem, satellite: SatelliteProblem) -> Network:
    """Return the network whose paths are plans that the referee accepts (stations aside)."""
    return _network(problem, satellite, -2.0 * STRICT)


def _network(problem: Problem, satellite: SatelliteProblem, slack: float) -> Network:
    """Return a network with limits relaxed by ``slack`` (tightened if it is negative).

    Searches call this again whenever worths or kept tasks have changed: all else is built once.
    """
    made = _made.setdefault(satellite, {})
    kind = problem.use_resources, problem.dynamics, slack
    if kind not in made:
        made[kind] = _without_worth(problem, satellite, slack)
    network = made[kind]
    return network._replace(
        is_kept=np.isin(satellite.rows, problem.kept_rows),
        delivered=_delivered(problem, satellite, network.data_floor, max(slack, 0.0)),
        must_deliver=must_deliver(problem, satellite),
        left_cost=left_cost(problem, satellite),
    )


def _without_worth(problem: Problem, satellite: SatelliteProblem, slack: float) -> Network:
    """Return a network without what depends on worths and pins."""
    track = resource_columns(problem, satellite)
    precedence = direct_precedence(satellite)
    charge_from = track.charge_per_s * track.charge_from_s
    charge_to = track.charge_per_s * track.charge_to_s
    is_free = not problem.use_resources or satellite.resources.sun_pointing == "free"
    least_to = np.minimum.accumulate(charge_to[::-1])[::-1]
    charged_from = np.searchsorted(least_to, charge_from) * (not is_free)
    idle_from, near_first, near_rows = _arcs(precedence, charged_from)
    straight_first, straight_rows = reversed_arcs(Arcs(near_first, near_rows))
    near_give = charge_from[_sources(near_first)] - charge_to[near_rows]
    straight_give = charge_from[straight_rows] - charge_to[_sources(straight_first)]
    idle_drawn_from = track.idle_per_s * track.data_from_s
    idle_drawn_to = track.idle_per_s * track.data_to_s
    energy_from, energy_to = charge_from - idle_drawn_from, charge_to - idle_drawn_to
    floor = track.battery_floor_least if slack > 0.0 else track.battery_floor
    # A task may begin before another's end by the tolerance, and sunlight counts from there.
    rounding = track.charge_per_s * TIME_TOLERANCE_S if slack > 0.0 else 0.0
    data_from = track.telemetry_per_s * track.data_from_s
    spent = track.telemetry_per_s * (track.data_from_s - track.data_to_s)
    top = track.recorder_max + slack
    return Network(
        site=satellite.site,
        is_contact=(satellite.kind == CONTACT).astype(np.uint8),
        is_kept=np.zeros(len(satellite), dtype=np.bool_),
        idle_from=idle_from,
        by_idle=np.argsort(idle_from, kind="stable").astype(np.int32),
        near_first=near_first,
        near_rows=near_rows,
        near_give=np.maximum(near_give, 0.0) * (not is_free),
        straight_first=straight_first,
        straight_rows=straight_rows,
        straight_give=np.maximum(straight_give, 0.0) * (not is_free),
        energy_from=energy_from,
        energy_to=energy_to,
        energy_cap=track.battery_full - energy_to,
        energy_cost=track.battery_cost + energy_from - energy_to - rounding,
        energy_floor=floor - slack - energy_from,
        data_gain=track.recorder_gain - spent,
        data_floor=-data_from,
        data_before=top - track.telemetry_per_s * track.data_peak_s,
        data_after=top - data_from,
        delivered=np.zeros(len(satellite)),
        energy_start=track.battery_start,
        data_start=track.recorder_start,
        data_end=top - track.telemetry_per_s * track.data_end_s,
        must_deliver=False,
        left_cost=0.0,
    )


def must_deliver(problem: Problem, satellite: SatelliteProblem) -> bool:
    """Return whether to admit only plans whose images come down, except those that must be taken.

    Some best plan is of this kind if images count on the ground alone.
    """
    is_asked = problem.objective.is_delivered or problem.leaves_none_on_board
    return is_asked and problem.counts_delivery and is_transitive_on(satellite)


def left_cost(problem: Problem, satellite: SatelliteProblem) -> float:
    """Return what images that fill a recorder lose if they stay on board, at the typical rate.

    0 if that depends on when they come down, or if none may stay.
    """
    if problem.objective.half_life_s is not None or must_deliver(problem, satellite):
        return 0.0
    lost, size = lost_on_board(problem)[satellite.rows], image_size(satellite)
    counts = (lost > 0.0) & (size > 0.0)
    return float(np.median(lost[counts] / size[counts])) if counts.any() else 0.0


def worth_before_left(problem: Problem) -> Floats:
    """Return what images earn before ``left_cost`` is paid for those on board. Shape ``(n,)``.

    No less than they earn, down or on board: one that no contact follows earns its worth on board.
    """
    worth, lost = problem.worth.copy(), lost_on_board(problem)
    for satellite in problem.satellites:
        cost = left_cost(problem, satellite) * image_size(satellite)
        earns = worth[satellite.rows] > 0.0
        worth[satellite.rows] += np.where(earns, np.maximum(cost - lost[satellite.rows], 0.0), 0.0)
    return worth


def image_size(satellite: SatelliteProblem) -> Floats:
    """Return what each task records, in recorder capacities; 0 for contacts."""
    fill = (satellite.end_s - satellite.start_s) * satellite.resources.collect_fill_per_s
    return np.where(satellite.kind == COLLECT, fill, 0.0)


def _delivered(
    problem: Problem, satellite: SatelliteProblem, emptied: Floats, slack: float
) -> Floats:
    """Return the most data at the end with each row as the last image; see ``Network``."""
    fill = image_size(satellite)
    kept = problem.kept_local(satellite)
    kept = kept[satellite.kind[kept] == COLLECT]
    if slack == 0.0:
        # A plan also brings down the images that it must take, if that is possible.
        kept = kept[problem.worth[satellite.rows[kept]] == 0.0]
    delivered = emptied + float(fill[kept].sum()) + 3.0 * slack
    delivered[kept] = ANY_LEVEL
    return delivered


def _sources(first: Longs) -> Ints:
    """Return the task of each arc in a list of arcs by task."""
    return np.repeat(np.arange(len(first) - 1, dtype=np.int32), np.diff(first))


@kernel
def _arcs(precedence: Precedence, charged_from: Longs) -> tuple[Ints, Longs, Ints]:
    """Return from which row on all may follow each task by idling, and its arcs to rows before."""
    m = len(precedence.near_from)
    idle_from = np.empty(m, dtype=np.int32)
    first = np.zeros(m + 1, dtype=np.int64)
    for i in range(m):
        last = max(precedence.far_from[i], charged_from[i])
        while last > max(precedence.near_from[i], charged_from[i]) and comes_before(
            precedence, i, last - 1
        ):
            last -= 1
        idle_from[i] = last
        first[i + 1] = first[i]
        for j in range(precedence.near_from[i], last):
            first[i + 1] += comes_before(precedence, i, j)
    rows = np.empty(first[m], dtype=np.int32)
    at = 0
    for i in range(m):
        for j in range(precedence.near_from[i], idle_from[i]):
            if comes_before(precedence, i, j):
                rows[at] = j
                at += 1
    return idle_from, first, rows


@inlined
def may_be_next(network: Network, i: int, k: int) -> bool:
    """Return whether row ``k`` may follow row ``i`` directly."""
    if k >= network.idle_from[i]:
        return True
    for at in range(network.near_first[i], network.near_first[i + 1]):
        if network.near_rows[at] == k:
            return True
    return False


@inlined
def give_between(network: Network, i: int, k: int) -> float:
    """Return what the arc from row ``i`` to ``k`` gives back; 0 from the start (``i`` < 0)."""
    if i < 0 or k >= network.idle_from[i]:
        return 0.0
    for at in range(network.near_first[i], network.near_first[i + 1]):
        if network.near_rows[at] == k:
            return float(network.near_give[at])
    return 0.0


@kernel
def cost_on_board(network: Network, taken: Bools) -> float:
    """Return the cost of the data left after some rows, beyond what is on board at the start."""
    if network.left_cost == 0.0:
        return 0.0
    data = network.data_start
    for k in range(len(taken)):
        if taken[k]:
            data = max(network.data_floor[k], data + network.data_gain[k])
    return float(network.left_cost * (max(data, 0.0) - max(network.data_start, 0.0)))


def part_of(network: Network, rows: Ints) -> Network:
    """Return the network of some rows only, ascending; levels stay those of the whole."""
    idle_from = np.searchsorted(rows, network.idle_from[rows]).astype(np.int32)
    near_first, near_rows, near_give = _arcs_among(network, rows)
    straight_first, straight_rows = reversed_arcs(Arcs(near_first, near_rows))
    of_rows = {
        name: getattr(network, name)[rows]
        for name in (
            "site", "is_contact", "is_kept", "energy_from", "energy_to", "energy_cap",
            "energy_cost", "energy_floor", "data_gain", "data_floor", "data_before", "data_after",
            "delivered",
        )
    }  # fmt: skip
    return network._replace(
        idle_from=idle_from,
        by_idle=np.argsort(idle_from, kind="stable").astype(np.int32),
        near_first=near_first,
        near_rows=near_rows,
        near_give=near_give,
        straight_first=straight_first,
        straight_rows=straight_rows,
        # Arcs are in order of the earlier row, and so are those to one later row.
        straight_give=near_give[np.argsort(near_rows, kind="stable")],
        **of_rows,
    )


@kernel
def _arcs_among(network: Network, rows: Ints) -> tuple[Longs, Ints, Floats]:
    """Return the arcs among some rows, and the energy that they give back."""
    m = len(rows)
    new_row = np.empty(len(network.site), dtype=np.int32)
    for row in range(len(new_row)):
        new_row[row] = -1
    for new in range(m):
        new_row[rows[new]] = new
    first = np.zeros(m + 1, dtype=np.int64)
    near_rows = np.empty(len(network.near_rows), dtype=np.int32)
    near_give = np.empty(len(network.near_rows))
    num_arcs = 0
    for new in range(m):
        row = rows[new]
        for at in range(network.near_first[row], network.near_first[row + 1]):
            j = new_row[network.near_rows[at]]
            if j >= 0:
                near_rows[num_arcs] = j
                near_give[num_arcs] = network.near_give[at]
                num_arcs += 1
        first[new + 1] = num_arcs
    return first, near_rows[:num_arcs].copy(), near_give[:num_arcs].copy()

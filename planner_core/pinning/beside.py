"""Which opportunities conflict with kept actions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.precedence.relation import excluded_beside
from planner_core.problem import COLLECT, CONTACT, Bools, Kept, Longs, Problem
from planner_core.problem.slew import TIME_TOLERANCE_S


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Beside:
    """Pairs of a kept action and an opportunity that conflicts with it, sorted in that order.

    Attributes
    ----------
    position
        Position among the kept actions. Shape ``(k,)``, as for ``row``.
    """

    position: Longs
    row: Longs

    def of(self, position: int) -> Longs:
        """Return the rows that conflict with one of the kept actions."""
        low, high = self.position.searchsorted([position, position + 1])
        return self.row[low:high]


def excluded_by_kept(problem: Problem, kept: Sequence[Kept]) -> Beside:
    """Return conflicts with kept actions: too close to turn, no antenna, target imaged twice.

    Conflicts between kept actions are left out.
    """
    table, n = problem.opportunities, len(problem.opportunities)
    rows = np.array([one.row for one in kept], dtype=np.int64)
    parts = [_images_of_the_same(problem, rows), *_without_antenna(problem, rows)]
    for index, satellite in enumerate(problem.satellites):
        own = np.flatnonzero(table.satellite[rows] == index)
        position, local = excluded_beside(satellite, problem.local_row[rows[own]])
        parts.append((own[position], satellite.rows[local].astype(np.int64)))
    position, row = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    is_kept = np.zeros(n, dtype=np.bool_)
    is_kept[rows] = True
    is_other = ~is_kept[row]
    pairs = np.sort(position[is_other] * n + row[is_other])
    is_first = np.diff(pairs, prepend=-1) > 0
    position, row = np.divmod(pairs[is_first], max(1, n))
    return Beside(position=position, row=row)


def _images_of_the_same(problem: Problem, rows: Longs) -> tuple[Longs, Longs]:
    """Return pairs of a kept collect and an image of its target."""
    images, offsets = problem.target_opportunities
    own = np.flatnonzero(problem.opportunities.kind[rows] == COLLECT)
    target = problem.opportunities.site[rows[own]]
    count = offsets[target + 1] - offsets[target]
    first_of = np.cumsum(count) - count
    at = np.arange(count.sum()) - np.repeat(first_of - offsets[target], count)
    return np.repeat(own, count), images[at].astype(np.int64)


def _without_antenna(problem: Problem, rows: Longs) -> list[tuple[Longs, Longs]]:
    """Return pairs of a kept contact and a contact for which kept ones leave no antenna."""
    table = problem.opportunities
    is_contact = table.kind == CONTACT
    pairs = []
    for station in np.unique(table.site[rows[is_contact[rows]]]):
        others = np.flatnonzero(is_contact & (table.site == station))
        own = np.flatnonzero(is_contact[rows] & (table.site[rows] == station))
        for position in own:
            found = others[_finds_none(problem, rows[position], rows[own], others)]
            pairs.append((np.full(len(found), position), found))
    return pairs


def _finds_none(problem: Problem, row: int, kept: Longs, others: Longs) -> Bools:
    """Return which contacts of a station overlap ``row`` and get no antenna beside ``kept``."""
    table = problem.opportunities
    from_s = np.maximum(table.start_s[others], table.start_s[row])
    to_s = np.minimum(table.end_s[others], table.end_s[row])
    is_running = (table.start_s[kept] <= from_s[:, None]) & (
        table.end_s[kept] > from_s[:, None] + TIME_TOLERANCE_S
    )
    num_antennas = problem.station_antennas[table.site[row]]
    is_crowded = is_running.sum(axis=1) >= num_antennas
    return np.asarray((to_s > from_s + TIME_TOLERANCE_S) & is_crowded)

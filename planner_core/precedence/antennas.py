"""Contacts that compete for the same antennas at the same time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from planner_core.problem import CONTACT, Floats, Longs, Problem
from planner_core.problem.slew import TIME_TOLERANCE_S


class AntennaGroup(NamedTuple):
    """Contacts of a station at the same instant, with more satellites than it has antennas.

    Attributes
    ----------
    rows
        Opportunities, ascending.
    limit
        How many of them a plan may take: the number of the station's antennas.
    """

    rows: Longs
    limit: int


_known: Final[WeakKeyDictionary[Problem, tuple[AntennaGroup, ...]]] = WeakKeyDictionary()


def antenna_groups(problem: Problem) -> tuple[AntennaGroup, ...]:
    """Return the maximal groups, by station and in order of time.

    A plan that takes no more contacts of each than its limit has an antenna for every contact.
    """
    groups = _known.get(problem)
    if groups is None:
        groups = _known[problem] = tuple(_groups(problem))
    return groups


def _groups(problem: Problem) -> Iterator[AntennaGroup]:
    table = problem.opportunities
    for station, antennas in enumerate(problem.station_antennas.tolist()):
        rows = np.flatnonzero((table.kind == CONTACT) & (table.site == station))
        for contacts in at_the_same_time(problem, rows):
            # A satellite has one contact at a time, whatever its station can serve.
            if len(np.unique(table.satellite[contacts])) > antennas:
                yield AntennaGroup(np.array(contacts, dtype=np.int64), antennas)


def at_the_same_time(problem: Problem, rows: npt.NDArray[np.integer]) -> list[list[int]]:
    """Return the maximal sets of these opportunities that overlap at one instant, in time order.

    Rows are ascending in each set.
    """
    table = problem.opportunities
    rows = rows[np.argsort(table.start_s[rows], kind="stable")]
    running: set[int] = set()
    found = []
    for at, row in enumerate(rows.tolist()):
        still = rows[:at][table.end_s[rows[:at]] > table.start_s[row] + TIME_TOLERANCE_S]
        now = {row, *still.tolist()}
        if not running <= now:
            # One of the running ones has ended, so their set could not grow any more.
            found.append(running)
        running = now
    return [sorted(one) for one in [*found, running] if one]


def antenna_charges(problem: Problem, multipliers: Floats | None) -> Floats:
    """Return what each opportunity pays for antennas at these multipliers. Shape ``(n,)``."""
    charges = np.zeros(len(problem.opportunities))
    if multipliers is not None:
        for group, multiplier in zip(antenna_groups(problem), multipliers.tolist(), strict=True):
            charges[group.rows] += max(multiplier, 0.0)
    return charges


def paid_for_antennas(problem: Problem, multipliers: Floats | None) -> float:
    """Return the sum of limits times multipliers: the most that any plan pays for antennas."""
    if multipliers is None:
        return 0.0
    limits = np.array([group.limit for group in antenna_groups(problem)], dtype=np.float64)
    return float(limits @ np.maximum(multipliers, 0.0))

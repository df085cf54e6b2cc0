"""Tasks of a plan that conflict with another task."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from planner_core.precedence.relation import fit_beside
from planner_core.problem import CONTACT, Ints, Problem
from planner_core.problem.slew import TIME_TOLERANCE_S


def conflicts(problem: Problem, row: int, taken: Collection[int] | Ints) -> list[int]:
    """Return which of these rows conflict with ``row``: no time to turn, or no antenna."""
    table, local = problem.opportunities, problem.local_row
    others = taken if isinstance(taken, np.ndarray) else np.array(list(taken), dtype=np.int64)
    others = others[others != row]
    satellite = int(table.satellite[row])
    own = others[table.satellite[others] == satellite]
    beside = local[own].astype(np.int64)
    fits = fit_beside(problem.satellites[satellite], np.full_like(beside, local[row]), beside)
    found: list[int] = own[~fits].tolist()
    if table.kind[row] == CONTACT:
        station = table.site[row]
        there = others[(table.kind[others] == CONTACT) & (table.site[others] == station)]
        at_once = (table.start_s[there] < table.end_s[row] - TIME_TOLERANCE_S) & (
            table.end_s[there] > table.start_s[row] + TIME_TOLERANCE_S
        )
        there = there[at_once]
        if len(there) >= problem.station_antennas[station]:
            found += there[~np.isin(there, found)].tolist()
    return found

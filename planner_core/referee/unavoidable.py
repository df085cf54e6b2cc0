"""The best levels that battery and recorder can reach, whatever is planned after a freeze.

A replan begins with the actions that are flown anyway. If these lead beyond a limit, no plan is to
blame. So battery and recorder are compared with the levels reached if nothing more draws energy or
writes data, and every remaining contact takes data down.
"""

from __future__ import annotations

from typing import Final, Literal
from weakref import WeakKeyDictionary

import numpy as np

from planner_core.problem import CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.resource_profile import Curve, integrate

_SAME: Final = 1e-9  # of a capacity
_known: WeakKeyDictionary[Problem, dict[tuple[str, int], Curve]] = WeakKeyDictionary()


def is_unavoidable(
    problem: Problem, index: int, code: Literal["battery", "recorder"], level: float, at_s: float
) -> bool:
    """Return whether no plan is within a limit at an instant, or better there than ``level``.

    True is proven, since contacts may overlap here and need neither energy nor turns.
    """
    if not problem.pinned.follows:
        return False
    best = _level_at(problem, _at_best(problem, index, code), code, at_s)
    r = problem.satellites[index].resources
    if code == "battery":
        return best <= r.battery_min_fraction + _SAME and level >= best - _SAME
    return best >= r.recorder_max_fraction - _SAME and level <= best + _SAME


def beyond_from_s(problem: Problem, index: int) -> float | None:
    """Return when a satellite's recorder is first too full whatever the plan; None for never."""
    limit = problem.satellites[index].resources.recorder_max_fraction
    curve = _at_best(problem, index, "recorder")
    beyond_s = curve.time_s[curve.recorder >= limit]
    return float(beyond_s[0]) if len(beyond_s) else None


def _at_best(problem: Problem, index: int, code: str) -> Curve:
    found = _known.setdefault(problem, {})
    if (code, index) not in found:
        rows = _flown(problem, index)
        if code == "recorder":
            rows = sorted({*rows, *_contacts(problem, index)})
        least = Plan.of(problem, rows)
        found[code, index] = integrate(problem, problem.satellites[index], least).curve
    return found[code, index]


def _flown(problem: Problem, index: int) -> list[int]:
    """Return the rows of a satellite that every plan holds."""
    table = problem.opportunities
    return [row for row in problem.kept_rows.tolist() if table.satellite[row] == index]


def _contacts(problem: Problem, index: int) -> list[int]:
    """Return the row of the longest contact in each pass of a satellite."""
    table = problem.opportunities
    rows = problem.satellites[index].rows
    rows = rows[table.kind[rows] == CONTACT]
    longest = rows[np.argsort(table.start_s[rows] - table.end_s[rows], kind="stable")]
    _, first = np.unique(table.access[longest], return_index=True)
    own: list[int] = longest[first].tolist()
    return own


def _level_at(problem: Problem, curve: Curve, code: str, at_s: float) -> float:
    level = curve.battery if code == "battery" else curve.recorder
    if problem.dynamics == "physical":
        return float(np.interp(at_s, curve.time_s, level))
    return float(level[max(0, int(np.searchsorted(curve.time_s, at_s, side="right")) - 1)])

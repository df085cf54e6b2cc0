"""What the referee says of a satellite's own actions, whatever the others do.

From one plan of a search to the next few satellites change, and what was said of the others holds:
of README's fleet four in ten have been judged before.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Final, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from planner_core.problem import Floats, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.delivery import delivered_s
from planner_core.referee.limits import limits_broken
from planner_core.referee.resource_profile import Profile, integrate
from planner_core.referee.rules import turns
from planner_core.referee.timeline import Violation

_MOST_KEPT: Final = 500_000
"""Actions and points of curves that are remembered of a problem: 20 MB."""


class Alone(NamedTuple):
    """The verdict on a satellite's own actions, which are counted from 0.

    Attributes
    ----------
    turns, limits
        What they break between one and the next, and of battery and recorder.
    profile
        Battery and recorder under them; None where the problem knows none.
    down_s
        When the image of each is on the ground; NaN for never, and for contacts.
    """

    turns: list[Violation]
    limits: list[Violation]
    profile: Profile | None
    down_s: Floats

    @property
    def size(self) -> int:
        """How many actions and points of curves it holds."""
        num_points = 0 if self.profile is None else len(self.profile.curve.time_s)
        return len(self.down_s) + num_points


def judged_alone(problem: Problem, index: int, plan: Plan, positions: Sequence[int]) -> Alone:
    """Return the verdict on a satellite's actions of a plan, which are given in order."""
    if problem not in _known:
        _known[problem] = _Known()
    return _known[problem].verdict(problem, index, plan, positions)


class _Known:
    """The verdicts on satellites of a problem that were asked for last, by any thread."""

    def __init__(self) -> None:
        self._verdicts: dict[tuple[int, bytes, bytes, bytes], Alone] = {}
        self._size = 0
        self._lock = Lock()

    def verdict(self, problem: Problem, index: int, plan: Plan, positions: Sequence[int]) -> Alone:
        """Return a verdict that is known or worked out now."""
        own = plan.columns.at(np.asarray(positions, dtype=np.int64))
        asked = index, own.row.tobytes(), own.start_s.tobytes(), own.end_s.tobytes()
        found = self._verdicts.get(asked)
        if found is None:
            found = judge_alone(problem, index, Plan(tuple(plan.actions[p] for p in positions)))
        with self._lock:
            before = self._verdicts.pop(asked, None)
            self._verdicts[asked] = found
            self._size += found.size if before is None else 0
            while self._size > _MOST_KEPT:
                self._size -= self._verdicts.pop(next(iter(self._verdicts))).size
        return found


_known: WeakKeyDictionary[Problem, _Known] = WeakKeyDictionary()


def judge_alone(problem: Problem, index: int, own: Plan) -> Alone:
    """Return the verdict on a plan of one satellite, worked out anew."""
    positions = range(len(own.actions))
    broken = turns(problem, own, index, positions)
    if not problem.use_resources:
        return Alone(broken, [], None, np.full(len(positions), np.nan))
    satellite = problem.satellites[index]
    profile = integrate(problem, satellite, own)
    return Alone(
        turns=broken,
        limits=limits_broken(problem, own, index, positions, profile),
        profile=profile,
        down_s=delivered_s(problem, satellite, own, profile),
    )

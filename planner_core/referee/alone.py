"""The referee's verdict on one satellite's actions, which does not depend on the other satellites.

Between successive plans of a search only a few satellites change, so verdicts are remembered: for
the README's fleet, four in ten satellites have been judged before.
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
"""How many actions and curve points are remembered per problem: 20 MB."""


class Alone(NamedTuple):
    """The verdict on a satellite's own actions, which are numbered from 0.

    Attributes
    ----------
    turns, limits
        Violations between successive actions, and of the limits of battery and recorder.
    profile
        Battery and recorder over the horizon; None if the problem ignores resources.
    down_s
        When the image of each action is on the ground; NaN for never, and for contacts.
    """

    turns: list[Violation]
    limits: list[Violation]
    profile: Profile | None
    down_s: Floats

    @property
    def size(self) -> int:
        """The number of actions and curve points in it."""
        num_points = 0 if self.profile is None else len(self.profile.curve.time_s)
        return len(self.down_s) + num_points


def judged_alone(problem: Problem, index: int, plan: Plan, positions: Sequence[int]) -> Alone:
    """Return the verdict on a satellite's actions, given by their positions in time order."""
    if problem not in _known:
        _known[problem] = _Known()
    return _known[problem].verdict(problem, index, plan, positions)


class _Known:
    """The most recently used verdicts on satellites of a problem, shared by all threads."""

    def __init__(self) -> None:
        self._verdicts: dict[tuple[int, bytes, bytes, bytes], Alone] = {}
        self._size = 0
        self._lock = Lock()

    def verdict(self, problem: Problem, index: int, plan: Plan, positions: Sequence[int]) -> Alone:
        """Return the remembered verdict, or work it out."""
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
    """Return the verdict on a plan of one satellite, without using remembered ones."""
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

"""A plan of the same worth that comes nearer to what is preferred.

The search for worth is over: its reward and bound stay the same, to the last bit. Aims are pursued
in their order, each by adding or dropping contacts and by replanning windows of images; the referee
judges the effect of every step on worth and aims. Later aims may make earlier ones worse by a
hundredth at most.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from planner_core.budget import Budget
from planner_core.certified.lns.downlinks import Accepts, with_contacts
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.lns.settled_contacts import worth_with
from planner_core.domain import Preference
from planner_core.preferences.aims import figure_of, liking_of, value_of
from planner_core.preferences.contacts import without_contacts
from planner_core.problem import Floats, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.view import View

_MOVES_AN_IMAGE: Final = 8
_FIRST_MOVES: Final = 10  # on each satellite: the first gain most
_LEAST_MOVES: Final = 64
_MOST_ROUNDS: Final = 24
_MOST_MISSES: Final = 6
_GROWTH: Final = 3.0
"""Factor on the number of moves after each accepted plan; its excess over 1 is halved after each
rejected one. Less than a move per satellite means a move on some. For 20 satellites over 2,000
cities the off-nadir aim alone reached 22.9 deg, the balance aim a share of 0.195 for the busiest;
with at least a move on each, 27.3 deg and 0.208, as before. With off-nadir second after `early`:
993 s and 25.9 deg in 0.7 s; if growth stays at 3, 956 s and 27.1 deg in 1.0 s."""
_MORE_CAUTION: Final = 4.0
"""Factor on the weight of earlier aims after each rejected plan. The same images reach 993 s and
25.9 deg off nadir with it, 983 s and 27.6 deg without (27.3 before); the busiest satellite takes
2.6 times the median's images, 2.9 without."""
_LEAST_GAIN: Final = 0.001  # relative gain of an aim that justifies another round
_SLACK: Final = 0.01  # relative loss of an aim that later ones may cause


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """The figure of an aim before and after: seconds, degrees, a share or a number."""

    aim: Preference
    before: float
    after: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Polished:
    """The plan, and its effect on each aim, in the order of the aims."""

    plan: Plan
    effects: tuple[Effect, ...]


def polished(
    problem: Problem, plan: Plan, aims: tuple[Preference, ...], budget: Budget, seed: int
) -> Polished:
    """Return a plan of the same worth that is as near or nearer to the aims."""
    view = View.of(problem, plan)
    before = {aim: figure_of(aim, value_of(view, aim)) for aim in aims}
    limits = dict[Preference, float]()
    windows: ResourceWindows | None = None
    if view.timeline.is_valid and view.images:
        for number, aim in enumerate(aims):
            accepts = _Acceptance(view, aim, limits)
            if aim in ("few_contacts", "margin"):
                view = without_contacts(view, accepts, budget)
            if not problem.continuous_starts and not budget.is_spent():
                # All aims share one search, since building it takes a while.
                windows = windows or ResourceWindows(problem, seed + number)
                view = _with_windows(view, windows, aims[: number + 1], accepts, budget)
            if aim == "early" and problem.use_resources:
                view = with_contacts(view, accepts, budget)
            reached = value_of(view, aim)
            limits[aim] = reached + _SLACK * abs(reached)
    effects = (
        Effect(aim=aim, before=before[aim], after=figure_of(aim, value_of(view, aim)))
        for aim in aims
    )
    return Polished(plan=view.plan, effects=tuple(effects))


class _Acceptance:
    """Decides whether a plan costs nothing and comes nearer to the current aim."""

    def __init__(self, view: View, aim: Preference, limits: Mapping[Preference, float]) -> None:
        self._reward, self._aim, self._limits = view.timeline.reward, aim, limits
        self._best = value_of(view, aim)

    def __call__(self, trial: View) -> bool:
        if not trial.timeline.is_valid or trial.timeline.reward != self._reward:
            return False
        value = value_of(trial, self._aim)
        if value >= self._best:
            return False
        if any(value_of(trial, aim) > limit for aim, limit in self._limits.items()):
            return False
        self._best = value
        return True


def _with_windows(
    view: View,
    windows: ResourceWindows,
    aims: Sequence[Preference],
    accepts: Accepts,
    budget: Budget,
) -> View:
    """Return the plan with windows of images replanned, contacts unchanged.

    They come nearer to the last of the aims. Earlier aims count as well, with a weight that rises
    each time a plan is rejected.
    """
    problem, aim = view.problem, aims[-1]
    caution = 1.0
    num_satellites = len(problem.satellites)
    most_moves = max(_LEAST_MOVES, _MOVES_AN_IMAGE * len(view.images) // num_satellites)
    num_moves, num_misses, growth = float(_FIRST_MOVES), 0, _GROWTH
    worth = _worth_in(view)
    for _ in range(_MOST_ROUNDS):
        liking = liking_of(view, aim)
        if liking is None or num_misses == _MOST_MISSES or budget.is_spent():
            break
        others = [one for one in (liking_of(view, other) for other in aims[:-1]) if one is not None]
        liking = (liking + caution * sum(others)) / (1.0 + caution * len(others))
        windows.go_by(worth, liking)
        windows.adopt(view.plan)
        windows.make_moves_on_each(num_moves, budget)
        before = value_of(view, aim)
        trial = View.of(problem, windows.plan)
        if accepts(trial):
            view = trial
            gained = before - value_of(view, aim)
            if num_moves == most_moves and gained < _LEAST_GAIN * abs(before):
                break
            num_moves = min(growth * num_moves, most_moves)
        else:
            # Fewer moves at once are less likely to lose something together.
            num_moves, num_misses = num_moves / _GROWTH, num_misses + 1
            growth = 1.0 + (growth - 1.0) / 2.0
            caution *= _MORE_CAUTION
    return view


def _worth_in(view: View) -> Floats:
    """Return roughly what each image earns with the contacts of the plan."""
    problem = view.problem
    if not problem.counts_delivery:
        return problem.worth
    return worth_with(problem, [contact.opportunity for contact in view.contacts])

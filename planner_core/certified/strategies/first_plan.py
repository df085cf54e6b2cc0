"""The plans that searches start from."""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.budget import Budget, ignored
from planner_core.certified.driver import Search
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import has_limits
from planner_core.solvers.forward_search import ForwardSearch
from planner_core.solvers.rule import Rule


def rule(search: Search) -> Iterator[None]:
    """Plan with the rule-based solver, whatever the budget."""
    plan = Rule().solve(search.problem, Budget(), search.seed).plan
    if has_limits(search.problem):
        search.engine(ResourceSearch).offer(plan)
    else:
        search.best.offer(plan)
    yield


def forward_search(search: Search) -> Iterator[None]:
    """Plan by forward search, whose images come down early: it takes every contact that it can.

    The rule waits until the recorder is nearly full: four satellites over 1,000 targets, with a
    half-life of 1 h, earn 360.5 instead of 89.6 after a twentieth of a second.
    """
    # What it reports on the way are not yet plans that the referee has judged.
    quiet = search.budget.part(1.0, ignored)
    plan = ForwardSearch().solve(search.problem, quiet, search.seed).plan
    search.engine(ResourceSearch).offer(plan)
    yield
